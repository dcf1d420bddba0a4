"""`rig.explore()`: the page of the virtual rig in a notebook, with the bits of the library."""

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
