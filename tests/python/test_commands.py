"""Commands, records and the flow table, with NumPy arrays."""

import contextlib
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import chirp

import eft

FLOWS = eft.Rig.zhao2005()["servovalve.flow_table.flows"]
OPENINGS = eft.Rig.zhao2005()["servovalve.flow_table.openings"]
TABLE = eft.FlowTable(OPENINGS, FLOWS)


def test_the_sweep_is_scipys_chirp():
    sweep = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=10.0, duration=32.0, sample_rate=4096.0)
    expected = 8900.0 * chirp(sweep.time, 0.5, 32.0, 10.0, phi=-90)
    np.testing.assert_allclose(sweep.values, expected, atol=1e-6)
    assert len(sweep) == 131072 and sweep.duration == 32.0 and sweep.sample_rate == 4096.0


def test_the_effective_force_opposes_the_ground_linearly_resampled():
    ground = np.sin(np.arange(50.0))
    record = eft.Record(ground, 0.02, "made up")
    command = eft.effective_force(record, mass=7040.0, sample_rate=1000.0, scale=0.5)
    expected = -7040.0 * 0.5 * np.interp(command.time, record.time, ground)
    np.testing.assert_allclose(command.values, expected, rtol=1e-9, atol=1e-9)
    assert command.time[-1] <= record.time[-1] + 1e-12


RECORD = eft.Record([0.0, 1.0, -1.0, 0.0], 0.1)
_ONE = eft.Command([1.0], 1024.0)


@pytest.mark.parametrize("true", [True, np.True_, np.array(True)])
@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("duration", lambda true: eft.sine_sweep(1.0, 0.0, 1.0, true, 100.0)),
        ("scale", lambda true: eft.effective_force(RECORD, 1.0, 100.0, scale=true)),
        ("mass", lambda true: eft.effective_force(RECORD, true, 100.0)),
        ("sample_rate", lambda true: eft.Command([0.0, 1.0], true)),
        ("start", lambda true: eft.Command.step(1.0, 1.0, 100.0, start=true)),
        ("band", lambda true: eft.Command.noise(1.0, (true, 5.0), 1.0, 100.0)),
        ("dt", lambda true: eft.Record([0.0, 1.0], true)),
        ("time", lambda true: RECORD.scaled(time=true)),
        ("structure.mass", lambda true: eft.Rig.zhao2005().replace({"structure.mass": true})),
        ("dac.delay", lambda true: eft.Rig.zhao2005().replace({"dac.delay": true})),
        ("operand", lambda true: eft.Command([1.0], 10.0) * true),
        ("operand", lambda true: true * eft.Command([1.0], 10.0)),
        ("operand", lambda true: eft.Command([1.0], 10.0) / true),
        ("sample_rate", lambda true: eft.Plant(eft.Rig.zhao2005(), true)),
        ("sample_rate", lambda true: eft.Controller(eft.Rig.zhao2005(), sample_rate=true)),
        ("sample_rate", lambda true: eft.identify_delay([0.0], [0.0], true)),
        ("sample_rate", lambda true: eft.linearize(eft.Rig.zhao2005(), sampled=True, sample_rate=true)),
        ("largest_step", lambda true: eft.simulate(eft.Rig.zhao2005(), _ONE, largest_step=true)),
        ("piston_area", lambda true: eft.identify_flow_curve([0.0], [0.0], 1.0, true)),
    ],
)
def test_a_truth_value_is_no_number(argument, call, true):
    with pytest.raises((TypeError, ValueError), match=argument):
        call(true)


@pytest.mark.parametrize("two", [np.float64(2), np.float32(2), np.int64(2), np.array(2.0)])
def test_a_number_of_numpy_is_a_factor(two):
    command = eft.Command([1.0, 2.0], 10.0)
    assert two * command == command * two == eft.Command([2.0, 4.0], 10.0)
    assert command / two == eft.Command([0.5, 1.0], 10.0)


def test_an_array_is_no_factor():
    command = eft.Command([1.0, 2.0], 10.0)
    array = np.array([1.0, 2.0])
    for call in (lambda: array * command, lambda: command * array, lambda: array - command):
        with pytest.raises(TypeError, match=r"Command"):
            call()
    for call in (lambda: array + command, lambda: command + array):
        with pytest.raises(TypeError):
            call()


MASKED = np.ma.array([1, 2, 3], mask=[False, True, False])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: eft.Command(MASKED, 10.0), "NaN at sample 1"),
        (lambda: eft.Command(np.ma.array([[1.0, 2.0]], mask=[[False, True]]), 10.0), "NaN at sample 1"),
        (lambda: eft.Command([MASKED, MASKED], 10.0), "NaN at sample 1"),
        (lambda: eft.Record(MASKED, 0.1), "NaN at sample 1"),
        (lambda: eft.Command(np.ma.array([1j]), 10.0), "an array of complex128"),
        (lambda: TABLE.flow(MASKED), "NaN at element 1"),
    ],
)
def test_a_masked_sample_is_none(make, says):
    with pytest.raises(ValueError, match=says):
        make()
    assert eft.Command(np.ma.array([1, 2]), 10.0) == eft.Command([1.0, 2.0], 10.0)


def test_commands_and_records_are_values():
    command = eft.Command([0, 1, 2], 10)
    assert command == pickle.loads(pickle.dumps(command)) == eft.Command(np.array([0.0, 1.0, 2.0]), 10.0)
    assert command != eft.Command([0, 1, 2], 11)
    np.testing.assert_array_equal(command.time, [0.0, 0.1, 0.2])
    record = eft.Record(np.float32([0, -3, 2]), 0.01, "a name")
    assert record == pickle.loads(pickle.dumps(record))
    assert (record.pga, record.dt, record.name, len(record)) == (3.0, 0.01, "a name", 3)
    for array in (command.values, record.acceleration):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_what_is_given_is_copied():
    values = np.ones(3)
    command = eft.Command(values, 10.0)
    values[0] = np.nan
    np.testing.assert_array_equal(command.values, np.ones(3))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: eft.Command([], 10.0), "no samples: must have at least one"),
        (lambda: eft.Command([1.0, math.nan], 10.0), "NaN at sample 1: every sample must be finite"),
        (lambda: eft.Command([1.0], 0.0), r"^sample_rate = 0: must lie within 1e-6 and 1e9 Hz$"),
        (lambda: eft.Command([1.0], 1e-300), r"^sample_rate = 1e-300: must lie within"),
        (lambda: eft.Record([1.0], 1e300), r"^dt = 1e300: must lie within 1e-9 and 1000000 s$"),
        (lambda: eft.sine_sweep(1.0, 0.0, 1.0, 1.0, 1e300), r"^sample_rate = 1e300: must lie within"),
        (lambda: eft.Command([1.0], math.inf), r"^sample_rate = inf"),
        (
            lambda: eft.Command([[[1.0]]], 10.0),
            r"^values = an array of 3 dimensions: must have one dimension, or",
        ),
        (lambda: eft.Command(3.0, 10.0), r"^values = an array of 0 dimensions"),
        (lambda: eft.Command(["1"], 10.0), r"^values = an array of <U1: must be an array of real numbers$"),
        (lambda: eft.Command([1j], 10.0), r"^values = an array of complex128"),
        (lambda: eft.Command([[1.0], [1.0, 2.0]], 10.0), r"^values = .*must be an array of numbers$"),
        (lambda: eft.Command(None, 10.0), r"^values = an array of object"),
        (lambda: eft.Record([1.0], -0.01), r"^dt = -0\.01: must lie within"),
        (lambda: eft.Record([math.inf], 0.01), r"^acceleration = inf at sample 0"),
        (
            lambda: eft.sine_sweep(1.0, 0.0, 3.0, 1.0, 5.0),
            r"^f_end = 3: must lie within 0 and half the sample",
        ),
        (lambda: eft.sine_sweep(math.nan, 0.0, 1.0, 1.0, 5.0), r"^amplitude = NaN: must be finite"),
        (lambda: eft.sine_sweep(1.0, 0.0, 1.0, 1e12, 5.0), r"^number of samples = "),
        (lambda: eft.effective_force(eft.Record([1.0], 0.01), 0.0, 10.0), r"^mass = 0: must be positive"),
        (
            lambda: eft.read_record("x.at2", unit="furlong"),
            r'^unit = "furlong": must be a unit of acceleration',
        ),
    ],
)
def test_bad_arguments_are_named(make, says):
    with pytest.raises(ValueError, match=says):
        make()


def test_a_record_that_is_not_there():
    with pytest.raises(FileNotFoundError, match=r"nowhere\.at2"):
        eft.read_record("nowhere.at2")


def test_a_record_whose_count_disagrees_names_both(tmp_path):
    path = tmp_path / "short.at2"
    head = "PEER NGA STRONG MOTION DATABASE RECORD\nA test\nACCELERATION TIME SERIES IN UNITS OF G\n"
    path.write_text(head + "NPTS=   7, DT=   .0100 SEC\n 0.1 0.2 0.3\n 0.4 0.5\n")
    with pytest.raises(ValueError, match=r"short\.at2.*7.*5|short\.at2.*5.*7"):
        eft.read_record(path)
    path.write_text(head + "NPTS=   5, DT=   .0100 SEC\n 0.1 0.2 0.3\n 0.4 -0.5\n")
    record = eft.read_record(path)
    np.testing.assert_allclose(record.acceleration, 9.80665 * np.array([0.1, 0.2, 0.3, 0.4, -0.5]))
    assert record.dt == 0.01


def test_the_flow_table_is_linear_interpolation_both_ways():
    x = np.linspace(-1.2, 1.2, 1001)
    np.testing.assert_allclose(TABLE.flow(x), np.interp(x, OPENINGS, FLOWS), rtol=1e-14, atol=1e-20)
    q = np.linspace(-0.01, 0.01, 1001)
    np.testing.assert_allclose(TABLE.opening(q), np.interp(q, FLOWS, OPENINGS), rtol=1e-13, atol=1e-16)


def test_the_flow_table_keeps_the_shape_it_was_given():
    assert isinstance(TABLE.flow(0.5), float)
    assert isinstance(TABLE.flow(np.array(0.5)), float)
    assert TABLE.flow([]).shape == (0,)
    grid = np.linspace(-1, 1, 12).reshape(3, 4)[::-1, ::2]
    assert TABLE.flow(grid).shape == (3, 2)
    np.testing.assert_allclose(TABLE.opening(TABLE.flow(grid)), grid, atol=1e-15)
    assert TABLE.flow(0) == 0.0 and TABLE.opening(0) == 0.0


def test_the_flow_table_is_a_value():
    assert pickle.loads(pickle.dumps(TABLE)) == TABLE
    assert len(TABLE) == 21
    assert eft.FlowTable([-1, 0, 1], [-1, 0, 1]) != TABLE


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: eft.FlowTable([0.0, 1.0], [0.0, -1.0]), r"flows\[1\].*must increase strictly"),
        (lambda: eft.FlowTable([0.0, 0.0], [0.0, 1.0]), r"openings\[1\].*must increase strictly"),
        (lambda: eft.FlowTable([0.0, 1.0], [0.0, math.nan]), r"flows"),
        (lambda: eft.FlowTable([0.0, 1.0], [0.0]), r"flows|openings"),
        (lambda: eft.FlowTable([0.0], [0.0]), r"must have"),
        (lambda: eft.FlowTable(np.linspace(-1, 1, 65), np.linspace(-1, 1, 65)), r"65.*64"),
        (lambda: TABLE.flow(math.nan), r"^x = NaN: must be finite$"),
        (lambda: TABLE.opening([0.0, math.inf]), r"^q = inf at element 1: must be finite$"),
        (lambda: TABLE.flow("0.5"), r"^x = an array of <U3: must be an array of real numbers$"),
    ],
)
def test_bad_tables_are_named(make, says):
    with pytest.raises(ValueError, match=says):
        make()


@given(
    values=st.lists(st.floats() | st.integers(-(10**20), 10**20), max_size=5),
    rate=st.floats(),
    table=st.lists(st.tuples(st.floats(), st.floats()), max_size=6),
)
def test_any_numbers_make_a_value_or_a_value_error(values, rate, table):
    attempts = [
        lambda: eft.Command(values, rate),
        lambda: eft.Record(values, rate),
        lambda: eft.FlowTable([x for x, _ in table], [q for _, q in table]),
        lambda: TABLE.flow(values),
    ]
    for attempt in attempts:
        with contextlib.suppress(ValueError):
            attempt()


def test_arrays_may_start_at_any_byte_and_lie_anyhow():
    values = np.linspace(0.0, 1.0, 9)
    buffer = b"\0" + values.tobytes()
    misaligned = np.frombuffer(buffer, dtype=np.float64, offset=1, count=9)
    assert not misaligned.flags.aligned
    swapped, strided = values.astype(">f8"), np.repeat(values, 2)[::2]
    for array in (misaligned, swapped, strided):
        assert (eft.Command(array, 10.0).values == values).all()
