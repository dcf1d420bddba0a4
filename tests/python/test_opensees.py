"""OpenSees itself at both doors; skipped where it is not installed."""

import importlib.util
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.opensees import Site, serve

if importlib.util.find_spec("openseespy") is None:
    pytest.skip("openseespy is not installed", allow_module_level=True)

PAGE = Path(__file__).resolve().parents[2] / "docs/how-to/opensees.md"


def test_a_model_on_the_rig_moves_as_with_the_same_spring():
    rig, visits, started = eft.Rig.zhao2005().replace({"structure.kind": "linear"}), [], threading.Event()
    address = []

    def ready(*where):
        address.extend(where)
        started.set()

    server = threading.Thread(
        target=lambda: serve(Site(rig), port=0, clients=1, ready=ready, visited=visits.append), daemon=True
    )
    server.start()
    assert started.wait(10.0)
    (model,) = re.findall(
        r"^```\{code-block\} python\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL
    )
    spring = (
        'ops.uniaxialMaterial("Elastic", 1, 693.8e3); ops.node(2, 0.0); ops.fix(2, 1); '
        'ops.element("zeroLength", 1, 2, 1, "-mat", 1, "-dir", 1)'
    )
    found = _displacements(model.replace("8090", str(address[1])))
    wanted = _displacements(re.sub(r'ops\.element\("genericClient".*\)', spring, model))
    server.join(30.0)
    assert len(wanted) == 100 and np.abs(wanted).max() > 1e-3
    np.testing.assert_allclose(found, wanted, atol=1e-3 * np.abs(wanted).max())
    assert visits[0].steps == 100 and visits[0].ended_well


def _displacements(script):
    # A process of its own: OpenSees has one model, and it talks when it ends.
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return np.array([float(line) for line in done.stdout.split() if re.match(r"^-?\d", line)])
