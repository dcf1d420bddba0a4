"""Any numbers give a finite result or an error message, never a panic or a silent NaN."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

import eft

RIG = eft.Rig.zhao2005()
KEYS = {row["key"]: row for row in eft.rig_keys()}
FLOATS = sorted(key for key, row in KEYS.items() if row["type"] == "float" and RIG[key] not in (None, 0.0))
SHORT = eft.sine_sweep(amplitude=5000.0, f_start=0.5, f_end=20.0, duration=0.1, sample_rate=1024.0)

any_float = st.floats(allow_nan=True, allow_infinity=True)
some = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
few = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def refused(function, *arguments, **named):
    """The result of the function, or None after an error message."""
    try:
        return function(*arguments, **named)
    except ValueError as error:
        if not str(error).strip():
            raise
        return None


@st.composite
def rigs(draw):
    """The paper's rig with large changes of some of its numbers."""
    factor = st.floats(-6.0, 6.0).map(lambda power: 10.0**power)
    changes = {key: RIG[key] * draw(factor) for key in draw(st.lists(st.sampled_from(FLOATS), max_size=4))}
    changes["compensation.mode"] = draw(st.sampled_from(["off", "linear", "nonlinear"]))
    changes["controller.realization"] = draw(st.sampled_from(["analog", "digital"]))
    changes["compensation.adaptive"] = draw(st.booleans()) and changes["compensation.mode"] == "nonlinear"
    try:
        return RIG.replace(changes)
    except ValueError:
        return RIG


@some
@given(rigs(), st.sampled_from(["f32", "f64"]))
def test_any_rig_runs_to_finite_numbers_or_says_that_it_diverged(rig, dtype):
    run = refused(eft.simulate, rig, SHORT, dtype)
    if run is None:
        return
    for name in run._traces:
        trace = getattr(run, name)
        # A rig without self-calibration learns nothing.
        unknown = name.endswith("_deviation")
        assert np.isfinite(trace).all() or (unknown and (trace > 0.0).all()), (name, run.message)
    assert run.success == (len(run) == len(SHORT)), run.message
    metrics = refused(run.metrics)
    assert metrics is None or not any(math.isinf(value) for value in metrics.values())


@few
@given(rigs())
def test_any_rig_is_analysed_or_refused(rig):
    margin = refused(eft.stability_margin, rig)
    assert margin is None or margin >= 0.0
    model = refused(eft.linearize, rig, sampled=True)
    if model is not None:
        assert np.isfinite(model.A).all()
        assert refused(lambda: model.growth_rate) is None or math.isfinite(model.growth_rate)
    budget = refused(eft.linear.delay_budget, rig)
    assert budget is None or all(map(math.isfinite, dataclasses.astuple(budget)))
    answer = refused(eft.check_feasibility, rig, SHORT)
    assert answer is None or answer.verdict in ("go", "caution", "no")


@some
@given(any_float, any_float, any_float, any_float, any_float)
def test_a_sweep_of_any_numbers(amplitude, f_start, f_end, duration, rate):
    # At most the length of a test; a larger one is refused before it is made.
    if math.isfinite(duration) and math.isfinite(rate) and abs(duration * rate) > 1e6:
        duration = 1e3 / rate if rate else duration
    command = refused(eft.sine_sweep, amplitude, f_start, f_end, duration, rate)
    assert command is None or np.isfinite(command.values).all()


@some
@given(arrays(np.float64, st.integers(0, 40), elements=any_float), any_float, any_float, any_float, any_float)
def test_a_record_of_any_numbers(acceleration, dt, first, second, third):
    record = refused(eft.Record, acceleration, dt)
    if record is None:
        return
    for prepared in (
        refused(eft.Record.baseline_corrected, record),
        refused(eft.Record.band_passed, record, first, second),
        refused(eft.Record.scaled, record, acceleration=first, time=second),
        refused(eft.Record.tapered, record, first, second),
        refused(eft.Record.resampled, record, first) if abs(first) * dt < 1e3 else None,
    ):
        assert prepared is None or np.isfinite(prepared.acceleration).all()
    rate = third if 0 < third * dt * acceleration.size < 1e5 else 100.0 / dt
    command = refused(eft.effective_force, record, first, rate, second)
    assert command is None or np.isfinite(command.values).all()
    spectrum = refused(eft.records.displacement_spectrum, record, [first, 0.5], second)
    assert spectrum is None or np.isfinite(spectrum).all()


signals = arrays(np.float64, array_shapes(max_dims=2, min_side=0, max_side=64), elements=any_float)


@some
@given(signals, signals, any_float, any_float)
def test_identification_of_anything(one, other, rate, area):
    delay = refused(eft.identify_delay, one, other, rate)
    assert delay is None or math.isfinite(delay)
    table = refused(eft.identify_flow_curve, one, other, rate, area)
    assert table is None or np.isfinite(table.flows).all()
    damping = refused(eft.identification.identify_damping, one, rate)
    assert damping is None or all(math.isfinite(float(value)) for value in np.atleast_1d(damping))


@some
@given(signals, signals, any_float)
def test_a_flow_table_of_anything(openings, flows, place):
    table = refused(eft.FlowTable, openings, flows)
    if table is not None:
        assert (value := refused(table.flow, place)) is None or math.isfinite(value)
        assert (value := refused(table.opening, place)) is None or math.isfinite(value)


@some
@given(st.lists(any_float, min_size=5, max_size=40))
def test_the_controller_never_gives_what_a_valve_cannot_take(numbers):
    controller, compensator = eft.Controller(RIG), eft.Compensator(RIG)
    for start in range(len(numbers) - 3):
        four = numbers[start : start + 4]
        assert math.isfinite(controller.step(*four)) and math.isfinite(compensator.step(*four[:3]))


values = st.one_of(
    any_float, st.integers(), st.booleans(), st.none(), st.text(max_size=5), st.lists(any_float, max_size=2)
)


@few
@given(st.dictionaries(st.sampled_from(sorted(KEYS)), st.lists(values, max_size=2), max_size=2))
def test_a_study_of_anything_has_a_row_for_each_or_is_refused(parameters):
    study = refused(eft.study, RIG, SHORT, parameters)
    if study is None:
        return
    assert len(study) == math.prod(map(len, parameters.values())) == study.tests
    for row in study:
        assert (row["status"] == "completed") == (row["error"] is None)
        assert row["status"] != "failed", row["error"]
        assert row["nrmse"] is None or math.isfinite(row["nrmse"])


def test_many_keys_are_changed():
    assert len(FLOATS) > 20
    with pytest.raises(ValueError, match="structure"):
        RIG.replace({"structure.mass": float("nan")})
