"""Tests and a study whose reports are read, and what is in a report."""

import base64
import json
import re

import numpy as np

import eft


def both_modes():
    """The sweep of the paper with nonlinear and with linear compensation."""
    rig = eft.Rig.zhao2005()
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    return {
        mode: eft.simulate(rig.replace({"compensation.mode": mode}), command)
        for mode in ("nonlinear", "linear")
    }


def tripped():
    """A test that the protection ends early."""
    rig = eft.Rig.zhao2005().replace({"protection.enabled": True, "protection.force_trip": 4000.0})
    return eft.simulate(rig, eft.sine_sweep(8900.0, 0.5, 6.0, 6.0, 1024.0))


def learned():
    """A fixed controller, one that adapts, and one that corrects its curve as well."""
    rig = eft.Rig.zhao2005().replace({"servovalve.flow_gain_scale": 1.05})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 4096.0)
    adaptive = {"compensation.adaptive": True, "compensation.feedforward": True}
    changes = {
        "fixed": {},
        "adaptive": adaptive | {"compensation.curve_correction": False},
        "curve": adaptive | {"compensation.curve_correction": True},
    }
    return {name: eft.simulate(rig.replace(change), command) for name, change in changes.items()}


def study():
    """A study half of whose tests leave the stroke."""
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 1024.0)
    grid = {
        "compensation.mode": ["linear", "nonlinear"],
        "structure.mass": [6000.0, 7040.0],
        "actuator.stroke": [0.127, 0.001],
    }
    return eft.study(eft.Rig.zhao2005(), {"<a>": command}, grid)


def charts(text):
    """The charts of a report, as its script reads them."""
    return [json.loads(_unescape(spec)) for spec in re.findall(r'data-chart="([^"]*)"', text)]


def _unescape(text):
    return text.replace("&quot;", '"').replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")


def stored(text, name):
    """The numbers that a report keeps under a name."""
    data = re.search(rf'id="{name}">([^<]*)<', text)[1]
    return np.frombuffer(base64.b64decode(data), dtype="<f4")
