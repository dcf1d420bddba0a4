"""`rig.explore()`: the page of the virtual rig in a notebook, with the bits of the library."""

import importlib.util
import json
import re
import tomllib

import pytest

import eft
from eft import _explore
from test_explore import PAGE, fnv, made, opened

RIGS = {
    "the paper's": {},
    "another": {
        "name": 'north "2"', "structure.kind": "linear", "structure.mass": 7123.456, "supply.pressure": 35e6,
        "servovalve.flow_table.openings": [-1.0, 0.0, 1.0],
        "servovalve.flow_table.flows": [-1.1e-3, 0.0, 1.2e-3], "truth.servovalve.flow_gain_scale": 0.87,
        "compensation.adaptive": True, "limits.valve_command": 10.0,
    },
    "a robust one": {
        "controller.realization": "digital", "controller.force_loop": "robust", "structure.damping": 4000.5,
    },
}  # fmt: skip


@pytest.fixture
def page(monkeypatch):
    """The page that `make explore` has made, where the package keeps it."""
    monkeypatch.setattr(_explore, "FILE", PAGE)


@made
@pytest.mark.parametrize("name", RIGS)
def test_the_page_begins_with_the_rig(name, page, browser, tmp_path):
    rig = eft.Rig.zhao2005().replace(RIGS[name])
    answer = opened(browser, tmp_path, text=_explore.page(rig))
    assert answer["state"] == "ready" and not answer["wrong"]
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    assert answer["hash"] == fnv(eft.simulate(rig, command).force)
    values = tomllib.loads(answer["toml"])
    del values["command"]
    found = eft.Rig.from_dict({**values, "name": rig["name"]})
    assert found == rig


def test_settings_say_what_differs_from_the_paper_s_rig():
    assert _explore.settings(eft.Rig.zhao2005()) == ""
    lines = _explore.settings(eft.Rig.zhao2005().replace(RIGS["another"])).split("\n")
    assert "servovalve.flow_table.flows = [-0.0011, 0.0, 0.0012]" in lines
    assert "compensation.adaptive = true" in lines
    assert 'structure.kind = "linear"' in lines
    assert "name = none" in lines  # a text in quotation marks would not be read


def test_a_text_cannot_end_the_script(page, tmp_path):
    if not PAGE.exists():
        pytest.skip("no page: `make explore`")
    rig = eft.Rig.zhao2005().replace({"name": "</script><script>alert(1)</script>"})
    assert "</script><script>alert" not in _explore.page(rig)


def test_without_page_or_package_a_sentence_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setattr(_explore, "FILE", tmp_path / "none.html")
    with pytest.raises(FileNotFoundError, match=r"has no page of the virtual rig: .* `make explore`"):
        _explore.page(eft.Rig.zhao2005())
    monkeypatch.setitem(__import__("sys").modules, "anywidget", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'effective-force-testing\[notebook\]'"):
        eft.Rig.zhao2005().explore()


@made
def test_the_widget_holds_the_page(page):
    if importlib.util.find_spec("anywidget") is None:
        pytest.skip("anywidget is not installed")
    rig = eft.Rig.zhao2005().replace({"structure.mass": 9000.0})
    widget = rig.explore(height=700)
    assert (widget.height, widget.toml) == (700, "")
    start = json.loads(re.search(r"^const START = (.*);$", widget.page, re.MULTILINE)[1])
    assert start["values"]["m"] == 9.0
    assert start["lines"] == "structure.mass = 9000.0"
