"""The modules of the package: moved names work for one more release, results are typed and immutable."""

import dataclasses
import pickle
import subprocess
import sys

import numpy as np
import pytest

import eft
from eft import _moved

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(4000.0, 0.5, 5.0, 4.0, 1024.0)


@pytest.mark.parametrize("name", [*_moved._MOVED, *_moved._REPLACED])
def test_a_name_that_moved_works_and_says_where_to(name):
    with pytest.warns(
        DeprecationWarning, match=rf"^eft\.{name} (has moved|is removed in the next release): write "
    ) as caught:
        assert getattr(eft, name) is not None
    assert caught[0].filename == __file__
    assert name not in eft.__all__
    with pytest.raises(AttributeError, match="no attribute"):
        _ = eft.nothing


def test_figures_and_reports_load_when_they_are_used():
    script = """
import sys, eft
assert not {"eft.plots", "eft.report", "matplotlib"} & set(sys.modules)
assert callable(eft.plots.stability_map) and callable(eft.report.write_report)
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def test_what_replaced_them_gives_the_same():
    motion = eft.Record(np.sin(np.arange(400) / 9.0), 0.02, "a quake")
    with pytest.warns(DeprecationWarning, match=r"eft\.|dictionary"):
        before = eft.tapered(
            eft.band_passed(eft.baseline_corrected(motion, 2), 0.2, 10.0), start=1.0, end=1.0
        )
    assert before == motion.baseline_corrected(2).band_passed(0.2, 10.0).tapered(start=1.0, end=1.0)
    with pytest.warns(DeprecationWarning, match=r"eft\.|dictionary"):
        before = eft.resampled(eft.scaled(motion, time=0.5), 50.0)
    assert before == motion.scaled(time=0.5).resampled(50.0)
    with pytest.warns(DeprecationWarning, match=r"eft\.|dictionary"):
        before = eft.level_damping_map(RIG)
    found = eft.linear.stability_map(RIG, "level-damping")
    np.testing.assert_array_equal(before.values, found.values)
    with pytest.raises(ValueError, match=r"^map = 'level': must be one of \"level-damping\""):
        eft.linear.stability_map(RIG, "level")
    with pytest.raises(ValueError, match=r"^vertical = None"):
        eft.linear.stability_map(RIG, ("compensation.level", [1.0]))


def test_a_flow_table_knows_its_uncertainty():
    test = eft.identification.flow_test(RIG, amplitude=0.1)
    arguments = (test.spool, test.displacement, 2048.0, RIG["actuator.piston_area"])
    table = eft.identify_flow_curve(*arguments)
    assert table.uncertainty.shape == table.measured.shape == table.flows.shape
    assert table.measured.dtype == bool and (table.uncertainty >= 0.0).all()
    back = pickle.loads(pickle.dumps(table))
    assert back == table
    np.testing.assert_array_equal(back.uncertainty, table.uncertainty)
    np.testing.assert_array_equal(back.measured, table.measured)
    given = eft.FlowTable([-1.0, 1.0], [-1.0, 1.0])
    assert given.uncertainty is None and given.measured is None
    with pytest.raises(ValueError, match=r"^uncertainty = 1 values: must be one for each of 2 points"):
        eft.FlowTable([-1.0, 1.0], [-1.0, 1.0], [0.1])
    with pytest.warns(DeprecationWarning, match=r"eft\.|dictionary"):
        before = eft.flow_curve_estimate(*arguments)
    assert before.table == table and (before.measured == table.measured).all()


def test_results_are_typed_stay_and_are_dictionaries_for_a_release():
    margins = eft.linear.stability_margins(RIG, sampled=True)
    with pytest.raises(dataclasses.FrozenInstanceError):
        margins.level = 2.0
    with pytest.warns(
        DeprecationWarning, match=r"a StabilityMargins is no longer a dictionary: write \.level"
    ):
        assert margins["level"] == margins.level
    with pytest.warns(DeprecationWarning, match=r"eft\.|dictionary"), pytest.raises(KeyError):
        margins["levle"]
    assert dict(pickle.loads(pickle.dumps(margins)).__dict__) == margins.__dict__
    unstable = eft.linear.stability_margins(RIG.replace({"compensation.level": 1.2}))
    assert unstable.dead_time is None and unstable.growth_rate > 0.0
    feasible = eft.check_feasibility(RIG, SWEEP)
    assert feasible.verdict in ("go", "caution", "no") and isinstance(feasible.reasons, tuple)
    assert {demand.unit for demand in feasible.demands} <= {"N", "m", "m/s", "m³/s", "W", ""}


def test_estimates_are_numbers_that_stay():
    delay = eft.identify_delay(*eft.identification.valve_test(RIG), 2048.0)
    assert isinstance(delay, float) and delay.frequency.shape == delay.lag.shape
    assert delay.details.keys() == {"coherence", "frequency", "intercept", "lag"}
    back = pickle.loads(pickle.dumps(delay))
    assert back == delay and back.uncertainty == delay.uncertainty and back.intercept == delay.intercept
    with pytest.raises(AttributeError, match="cannot be changed"):
        delay.uncertainty = 0.0


def test_a_rig_has_its_keys():
    assert "compensation.level" in RIG and "compensation" in RIG and "truth.structure.mass" in RIG
    assert "compensation.levle" not in RIG and 3 not in RIG
    keys = RIG.keys()
    assert list(RIG) == keys and len(RIG) == len(keys) == len(set(keys))
    assert set(keys) == {row["key"] for row in eft.rig_keys() if not row["key"].startswith("truth.")}
    assert dict(RIG)["structure.mass"] == 7040.0
    offered = RIG._ipython_key_completions_()
    assert {"structure.mass", "structure", "servovalve.flow_table.flows", "truth.structure.mass"} <= set(
        offered
    )
    assert all(key in RIG for key in offered)


def test_commands_add_scale_and_slice():
    sine = eft.Command.sine(500.0, 2.0, 4.0, 1024.0)
    both = 0.5 * SWEEP + sine / 2 - -sine
    np.testing.assert_allclose(both.values, 0.5 * SWEEP.values + 1.5 * sine.values, atol=1e-9)
    part = both[1024:2048]
    assert len(part) == 1024 and part.sample_rate == 1024.0 and part.time[0] == 0.0
    np.testing.assert_array_equal(part.values, both.values[1024:2048])
    motion = eft.Record([0.0, 1.0, -1.0, 0.0], 0.1, "made up")
    force = eft.effective_force(motion, mass=7e3, sample_rate=100.0, scale=0.5)
    assert ((2.0 * force).scale, (2.0 * force).record, force[:10].mass) == (1.0, motion, 7e3)
    assert (force + force).record is None and pickle.loads(pickle.dumps(force)).scale == 0.5
    for wrong, says in [
        (
            lambda: SWEEP + sine[:5],
            "command = 1 actuators, 5 samples at 1024 Hz: must have 1 actuators, 4096",
        ),
        (lambda: SWEEP[5:5], r"slice = slice\(5, 5, None\): must be of at least one sample"),
        (lambda: SWEEP[::2], r"slice = slice\(None, None, 2\)"),
        (lambda: SWEEP * float("nan"), "NaN"),
    ]:
        with pytest.raises(ValueError, match=says):
            wrong()
    with pytest.raises(TypeError):
        SWEEP + 1.0
    with pytest.raises(TypeError):
        SWEEP * SWEEP


def test_noise_and_multisine_have_the_spectrum_they_should():
    noise = eft.Command.noise(200.0, (1.0, 8.0), duration=16.0, sample_rate=256.0, seed=3)
    tones = eft.Command.multisine(200.0, (1.0, 8.0), duration=16.0, sample_rate=256.0)
    frequency = np.fft.rfftfreq(len(noise), 1 / 256.0)
    inside = (frequency >= 1.0) & (frequency <= 8.0)
    for command in (noise, tones):
        power = np.abs(np.fft.rfft(command.values)) ** 2
        assert power[~inside].sum() < 1e-20 * power.sum()
    flat = np.abs(np.fft.rfft(tones.values))[inside]
    np.testing.assert_allclose(flat, flat[0], rtol=1e-9)
    assert np.abs(tones.values).max() == pytest.approx(200.0) and np.std(noise.values) == pytest.approx(200.0)
    assert noise == eft.Command.noise(200.0, (1.0, 8.0), 16.0, 256.0, seed=3)
