"""Both models of the page on OpenSees run as printed; skipped if it is not installed."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import eft
from finite_elements import displacements, site

if importlib.util.find_spec("openseespy") is None:
    pytest.skip("openseespy is not installed: pip install openseespy", allow_module_level=True)

PAGE = Path(__file__).resolve().parents[2] / "docs/how-to/opensees.md"
BLOCKS = re.findall(
    r"^```\{code-block\} python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
)
RIG = eft.Rig.zhao2005().replace({"structure.kind": "linear"})


def test_a_model_on_the_rig_moves_as_with_the_same_spring():
    model, _ = BLOCKS
    spring = (
        'ops.uniaxialMaterial("Elastic", 1, 693.8e3); ops.node(2, 0.0); ops.fix(2, 1); '
        'ops.element("zeroLength", 1, 2, 1, "-mat", 1, "-dir", 1)'
    )
    with site(RIG) as (port, visits):
        found = displacements(model.replace("8090", str(port)))
    wanted = displacements(re.sub(r'ops\.element\("genericClient".*\)', spring, model))
    assert len(wanted) == 100 and np.abs(wanted).max() > 1e-3
    np.testing.assert_allclose(found, wanted, atol=1e-3 * np.abs(wanted).max())
    assert visits[0].steps == 100 and visits[0].ended_well


def test_the_page_s_structure_runs():
    _, block = BLOCKS
    done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and re.match(r"\d+ mm, ", done.stdout), done.stderr
