"""`rig.explore()` without a browser: what the page of the virtual rig is given, and that it loads nothing."""

import importlib.util
import json
import re
import sys
from pathlib import Path

import pytest

import eft
from eft import _explore

TEMPLATE = Path(__file__).resolve().parents[2] / "crates" / "eft-web" / "page" / "explore.html"


@pytest.fixture
def page(monkeypatch):
    """The page without the module of the virtual rig, which `make explore` packs into it."""
    monkeypatch.setattr(_explore, "FILE", TEMPLATE)


def test_the_page_loads_nothing():
    text = TEMPLATE.read_text(encoding="utf-8")
    assert not re.search(r"https?://|<link|@import|fetch\(|XMLHttpRequest|<script src", text)
    assert "default-src 'none'" in text


def test_settings_say_what_differs_from_the_paper_s_rig():
    assert _explore.settings(eft.Rig.zhao2005()) == ""
    changes = {
        "name": 'north "2"', "structure.kind": "linear", "compensation.adaptive": True,
        "servovalve.flow_table.openings": [-1.0, 0.0, 1.0],
        "servovalve.flow_table.flows": [-1.1e-3, 0.0, 1.2e-3],
    }  # fmt: skip
    lines = _explore.settings(eft.Rig.zhao2005().replace(changes)).split("\n")
    assert "servovalve.flow_table.flows = [-0.0011, 0.0, 0.0012]" in lines
    assert "compensation.adaptive = true" in lines
    assert 'structure.kind = "linear"' in lines
    assert "name = none" in lines  # a text in quotation marks would not be read


def test_a_text_cannot_end_the_script(page):
    rig = eft.Rig.zhao2005().replace({"name": "</script><script>alert(1)</script>"})
    text = _explore.page(rig)
    assert "alert(1)" in text and "</script><script>alert" not in text


def test_without_page_or_package_a_sentence_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setattr(_explore, "FILE", tmp_path / "none.html")
    with pytest.raises(FileNotFoundError, match=r"has no page of the virtual rig: .* `make explore`"):
        _explore.page(eft.Rig.zhao2005())
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'effective-force-testing\[notebook\]'"):
        eft.Rig.zhao2005().explore()


def test_the_widget_holds_the_page(page):
    if importlib.util.find_spec("anywidget") is None:
        pytest.skip("anywidget is not installed")
    rig = eft.Rig.zhao2005().replace({"structure.mass": 9000.0})
    widget = rig.explore(height=700)
    assert (widget.height, widget.toml) == (700, "")
    start = json.loads(re.search(r"^const START = (.*);$", widget.page, re.MULTILINE)[1])
    assert start["values"]["m"] == 9.0
    assert start["lines"] == "structure.mass = 9000.0"
