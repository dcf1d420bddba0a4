"""`rig.explore()` in JupyterLab itself, in a headless Chromium; skipped where JupyterLab is not installed."""

import importlib.util
import json
import os
import subprocess
import sys
import time
import tomllib
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import pytest

import eft
from test_explore import PAGE, made

NEEDED = ("jupyterlab", "ipykernel", "anywidget")
if missing := [name for name in NEEDED if importlib.util.find_spec(name) is None]:
    pytest.skip(f"not installed: {', '.join(missing)}", allow_module_level=True)

CELL = """
from pathlib import Path
import eft
from eft import _explore
_explore.FILE = Path({page!r})
page = eft.Rig.zhao2005().replace({{"structure.mass": 9000.0}}).explore()
page.observe(lambda change: Path("told.toml").write_text(change["new"]), "toml")
page
"""
RUN_ALL = """(async () => {
  const app = window.jupyterapp;
  await app.restored;
  const shown = () => app.shell.currentWidget?.sessionContext;
  while (!shown()) await new Promise((done) => setTimeout(done, 100));
  await shown().ready;
  await app.commands.execute("notebook:run-all-cells");
  return true;
})()"""
FRAME = "document.querySelector('iframe[sandbox]').title"
MOVE = """(() => {
  const mass = document.querySelector("[name=m]");
  mass.stepUp(100);
  mass.dispatchEvent(new Event("input", { bubbles: true }));
  return document.title;
})()"""


def wait_for(look, seconds=60.0):
    """The first result of `look` that is not empty."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if (answer := look()) is not None:
            return answer
        time.sleep(0.1)
    raise AssertionError(f"nothing came within {seconds} s")


@contextmanager
def laboratory(folder):
    """The address of a JupyterLab in a folder."""
    command = [
        sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--expose-app-in-browser",
        "--ServerApp.ip=127.0.0.1", "--ServerApp.port=0", "--ServerApp.port_retries=0",
        "--ServerApp.token=eft", f"--ServerApp.root_dir={folder}",
    ]  # fmt: skip
    own = {"JUPYTER_RUNTIME_DIR": "runtime", "JUPYTER_CONFIG_DIR": "config", "JUPYTER_DATA_DIR": "data"}
    paths = [str(Path(eft.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {name: str(folder / one) for name, one in own.items()}
    environment |= {"PYTHONPATH": os.pathsep.join(paths), "IPYTHONDIR": str(folder / "ipython")}
    with (folder / "log").open("w") as log:
        server = subprocess.Popen(command, env=environment, stderr=log, stdout=log)
    try:

        def told():
            assert server.poll() is None, (folder / "log").read_text()
            files = list((folder / "runtime").glob("jpserver-*.json"))
            return json.loads(files[0].read_text())["url"] if files and files[0].stat().st_size else None

        yield wait_for(told)
    finally:
        server.terminate()
        server.wait(20)


@made
def test_a_slider_in_the_notebook_comes_back_to_python(browser, tmp_path):
    cells = [{"cell_type": "code", "id": "one", "source": CELL.format(page=str(PAGE)), "metadata": {},
              "outputs": [], "execution_count": None}]  # fmt: skip
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    notebook = {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    (tmp_path / "rig.ipynb").write_text(json.dumps(notebook))

    def test():
        file = tmp_path / "told.toml"
        values = tomllib.loads(file.read_text()) if file.is_file() and file.stat().st_size else {}
        return values.get("structure", {}).get("mass")

    with laboratory(tmp_path) as address:
        wait_for(lambda: answers(address))
        with browser.page(f"{address}lab/tree/rig.ipynb?token=eft") as page:
            wait_for(lambda: page.run("Boolean(window.jupyterapp) || null"))
            assert page.run(RUN_ALL)
            assert wait_for(test) == 9000.0
            assert page.run(FRAME) == "The virtual rig"
            assert page.inside(MOVE).startswith("The virtual rig of effective")
            assert wait_for(lambda: mass if (mass := test()) != 9000.0 else None) == 10_000.0


def answers(address):
    try:
        return urllib.request.urlopen(f"{address}api?token=eft", timeout=5).status
    except OSError:
        return None
