"""The uncertainty of a flow curve covers the error of its straight pieces on curved valves."""

import numpy as np
import pytest

import eft

RIG = eft.Rig.zhao2005()
OPENINGS = np.linspace(-1.0, 1.0, 61)
CURVES = {
    "saturating": 8.5e-3 * np.tanh(2.0 * OPENINGS),
    "steep at rest": 8e-3 * np.sign(OPENINGS) * abs(OPENINGS) ** 0.8,
    "steep at the ends": 8e-3 * (0.5 * OPENINGS + 0.5 * OPENINGS**3),
}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("knots", [11, 21])
def test_the_error_is_of_the_size_that_is_stated(name, knots):
    rig = RIG.replace({"servovalve.flow_table": eft.FlowTable(OPENINGS, CURVES[name])})
    rng = np.random.default_rng(0)
    spool, moved = [], []
    for share in (0.9, 0.8, 0.6, 0.4, 0.2):
        test = eft.identification.flow_test(rig, share * rig["actuator.stroke"])
        spool.append(test.spool)
        moved.append(test.displacement + 1e-5 * rng.standard_normal(test.spool.size))
    found = eft.identify_flow_curve(spool, moved, 2048.0, rig["actuator.piston_area"], knots)
    error = abs(found.flows - np.interp(found.openings, OPENINGS, CURVES[name]))
    off = np.flatnonzero(found.openings != 0.0)
    ratio = error[off] / found.uncertainty[off]
    measured = found.measured[off]
    assert 0.3 < np.sqrt(np.mean(ratio[measured] ** 2)) < 3.0 and ratio[measured].max() < 4.0
    # Points beyond the data are marked, and are more uncertain than any measured point.
    assert (~measured).any() and ratio[~measured].max() < 2.0
    assert found.uncertainty[off][~measured].min() > np.median(found.uncertainty[off][measured])
