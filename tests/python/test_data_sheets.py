"""Rigs from data sheets: the formulas compared with closed forms, and missing or wrong values."""

import json
from pathlib import Path

import numpy as np
import pytest

import eft
from eft._native import quantity
from eft.cli import main

GPM, PSI = 231 * 0.0254**3 / 60, 4.4482216152605 / 0.0254**2
SHEET = {
    "name": "a",
    "structure": {"mass": "12 t", "frequency": "2.3 Hz", "damping_ratio": "2 %"},
    "actuator": {"force": "250 kN", "stroke": "250 mm"},
    "servovalve": {"rated_flow": "90 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"},
    "supply": {
        "pressure": "3000 psi",
        "pump_flow": "20 gpm",
        "accumulator_volume": "10 gal",
        "precharge": "1500 psi",
    },
}


def toml(sheet):
    """A sheet as text."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in sheet.items() if not isinstance(value, dict)]
    for name, part in sheet.items():
        if isinstance(part, dict):
            lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in part.items())]
    return "\n".join(lines) + "\n"


def without(key):
    section, _, name = key.partition(".")
    return SHEET | {section: {one: value for one, value in SHEET[section].items() if one != name}}


def spool_response(rig, frequency):
    """Spool over valve command of a rig's keys, from Eqs. (2) and (3)."""
    valve = rig["servovalve"]
    s = 2j * np.pi * np.asarray(frequency)
    per_volt = valve["pilot_flow_gain"] / (valve["spool_area"] * valve["spool_stroke"])
    loop = per_volt * valve["spool_sensitivity"] * valve["spool_stroke"]
    return per_volt / (valve["pilot_time_constant"] * s**2 + s + loop)


def test_the_valve_has_the_flow_and_the_phase_of_its_sheet():
    rig = eft.Rig.zhao2005().replace(eft.servovalve("90 gpm", "1000 psi", "60 Hz", damping_ratio=0.8))
    table = eft.FlowTable(rig["servovalve.flow_table.openings"], rig["servovalve.flow_table.flows"])
    assert table.flow(1.0) == pytest.approx(90 * GPM * np.sqrt(3.0)) and rig["supply.pressure"] == 3000 * PSI
    low, at = spool_response(rig, [1e-3, 60.0])
    assert abs(low) == pytest.approx(0.1, rel=1e-6) and rig["compensation.valve_gain"] == pytest.approx(0.1)
    assert np.degrees(np.angle(at)) == pytest.approx(-90.0) and abs(at / low) == pytest.approx(
        1 / 1.6, rel=1e-6
    )
    slow = spool_response(rig, 0.01)
    assert -np.angle(slow) / (2 * np.pi * 0.01) == pytest.approx(rig["compensation.response_delay"], rel=1e-4)


@pytest.mark.parametrize("damping", [0.5, 0.9, 1.0, 2.0])
def test_a_rise_time_gives_the_frequency_that_has_it(damping):
    signal = pytest.importorskip("scipy.signal")
    rig = eft.Rig.zhao2005().replace(
        eft.servovalve(1e-3, 7e6, rise_time="5 ms", damping_ratio=damping, full_step_time="12 ms")
    )
    valve = rig["servovalve"]
    loop = valve["spool_sensitivity"] * valve["pilot_flow_gain"] / valve["spool_area"]
    time, step = signal.step(
        ([loop], [valve["pilot_time_constant"], 1.0, loop]), T=np.linspace(0, 0.1, 100_001)
    )
    assert time[np.argmax(step > 0.9)] - time[np.argmax(step > 0.1)] == pytest.approx(5e-3, rel=1e-3)
    rate = valve["pilot_flow_limit"] / (valve["spool_area"] * valve["spool_stroke"])
    assert rate == pytest.approx(1 / 12e-3)


def test_one_side_of_a_curve_serves_both():
    keys = eft.servovalve(1e-3, 7e6, 60.0, supply_pressure=7e6, flow_curve=[(0.5, 0.7), (1.0, 1.0)])
    assert keys["servovalve.flow_table.openings"] == [-1.0, -0.5, 0.0, 0.5, 1.0]
    assert keys["servovalve.flow_table.flows"] == pytest.approx([-1e-3, -0.7e-3, 0.0, 0.7e-3, 1e-3])
    assert keys["compensation.flow_gain"] == pytest.approx(1.4e-3)
    with pytest.raises(ValueError, match="flow_curve"):
        eft.servovalve(1e-3, 7e6, 60.0, flow_curve=[(-1.0, -1.0), (1.0, 1.0)])


@pytest.mark.parametrize(
    ("curve", "says"),
    [
        *(
            (curve, "must be pairs of opening and share")
            for curve in ("curve.csv", 3, [0, 1], [(0, 0, 0)], [""])
        ),
        ({"a": 1}, "must be pairs"),
        # Gallons and openings in per cent, and a curve that ends early.
        *(
            ([(0, 0), end], "must end at the opening 1 with a share of 1")
            for end in ((1, 60), (100, 1), (0.5, 0.6))
        ),
        *(
            ([begin, (0, 0), (1, 1)], "must begin at the opening -1 or above")
            for begin in ((-1, -60), (-100, -1))
        ),
    ],
)
def test_a_curve_of_another_form_or_unit_is_refused(curve, says):
    with pytest.raises(ValueError, match=rf"^flow_curve = .*: {says}"):
        eft.servovalve(1e-3, 7e6, 60.0, flow_curve=curve)


@pytest.mark.parametrize("curve", [[(-1, -0.5), (0, 0), (1, 1)], [(0.9999999999999999, 1)]])
def test_an_unequal_spool_and_rounding_are_no_other_unit(curve):
    assert eft.servovalve(1e-3, 7e6, 60.0, flow_curve=curve)["servovalve.flow_table.flows"][-1] > 0.0


def test_a_learned_curve_has_points_in_a_table_without_a_curve():
    """The fixed scheme meets the force with the curve that the first test found."""
    rig = eft.Rig.zhao2005().replace(eft.servovalve("120 gpm", "1000 psi", "60 Hz"))
    openings, flows = (np.array(rig[f"servovalve.flow_table.{key}"]) for key in ("openings", "flows"))
    bent = flows * (1.0 + 0.04 * np.sign(openings)) * (1.04 - 0.12 * np.abs(openings))
    table = {"openings": openings.tolist(), "flows": bent.tolist()}
    loop = {
        "controller.force_loop": "robust",
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
    rig = rig.replace({**loop, "compensation.adaptive": True, "servovalve.true_flow_table": table})
    command = eft.sine_sweep(8900.0, 0.0, 8.0, 24.0, 4096.0)
    found = eft.simulate(rig, command)
    visited = (np.abs(openings) > 0.05) & (np.abs(openings) < 0.9 * np.abs(found.spool).max())
    assert visited.sum() > 3 and found.found_flows[visited] == pytest.approx(bent[visited], rel=0.02)
    fixed = {"compensation.adaptive": False}
    before = eft.simulate(rig.replace(fixed), command).metrics()["nrmse"]
    after = eft.simulate(found.corrected_rig().replace(fixed), command).metrics()["nrmse"]
    assert after < 0.5 * before, (before, after)


def test_the_oil_column_has_its_stiffness():
    keys = eft.actuator("250 kN", "250 mm", supply_pressure="207 bar", bulk_modulus="1 GPa")
    area = 250e3 / 207e5
    assert keys["actuator.piston_area"] == pytest.approx(area) and keys["actuator.stroke"] == 0.125
    # Two springs β·A/(stroke/2) on one piston.
    stiffness = area**2 / keys["actuator.compressibility"]
    assert stiffness == pytest.approx(2 * 1e9 * area / 0.125)
    given = eft.actuator(area="100 cm²", stroke=0.2, oil_volume="4 L")
    assert given["actuator.compressibility"] == pytest.approx(4e-3 / (4 * 0.7e9))


def test_the_accumulator_follows_the_gas_law_near_its_pressure():
    keys = eft.data_sheets.supply("3000 psi", "20 gpm", "5 gal", "1500 psi", droop=0.05)
    assert keys["supply.droop"] * keys["supply.pump_flow"] == pytest.approx(0.05 * 3000 * PSI)
    air = 101325.0
    high, gas = 3000 * PSI + air, 5 * 231 * 0.0254**3 * (1500 * PSI + air) / (3000 * PSI + air)
    drawn = 1e-6 * gas
    fall = high - high * (gas / (gas + drawn)) ** 1.4
    assert drawn / fall == pytest.approx(keys["supply.accumulator"], rel=1e-4)
    assert eft.data_sheets.supply("207 bar") == {"supply.pressure": pytest.approx(207e5)}


def modal_ratios(keys):
    """φᵀCφ/(2ω) of a building's keys, computed with full matrices."""
    m, k, c = (np.array(keys[f"structure.stories.{name}"]) for name in ("masses", "stiffnesses", "dampings"))

    def matrix(springs):
        above = np.append(springs[1:], 0.0)
        return np.diag(springs + above) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)

    root = np.diag(1 / np.sqrt(m))
    squares, vectors = np.linalg.eigh(root @ matrix(k) @ root)
    return np.sqrt(squares), np.diag(vectors.T @ root @ matrix(c) @ root @ vectors) / (2 * np.sqrt(squares))


def test_a_building_has_the_damping_of_its_modes():
    build = eft.data_sheets.stories
    masses, stiffnesses = ["4 t", "3 t", "3 t"], ["900 kN/m", "800 kN/m", "700 kN/m"]
    keys = build(masses, stiffnesses, [0.02, 0.04, 0.06])
    omega, ratios = modal_ratios(keys)
    np.testing.assert_allclose(ratios, [0.02, 0.04, 0.06], rtol=1e-9)
    keys = build(masses, stiffnesses, [0.02, 0.06], rayleigh=(1, 3))
    _, ratios = modal_ratios(keys)
    b = np.linalg.solve([[0.5 / omega[0], 0.5 * omega[0]], [0.5 / omega[2], 0.5 * omega[2]]], [0.02, 0.06])
    np.testing.assert_allclose(ratios, 0.5 * b[0] / omega + 0.5 * b[1] * omega, rtol=1e-9)
    eft.Rig.zhao2005().replace(keys)
    with pytest.warns(UserWarning, match=r"damping_ratios = 2\.00%"):
        keys = build(masses, stiffnesses, 0.02)
    _, ratios = modal_ratios(keys)
    assert ratios[0] == pytest.approx(0.02, rel=1e-3) and min(keys["structure.stories.dampings"]) == 0.0
    assert ratios.min() > 0.01 and ratios.max() < 0.04
    with pytest.raises(ValueError, match="rayleigh"):
        build(masses, stiffnesses, [0.02, 0.04], rayleigh=(1, 4))


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: eft.servovalve("90 psi", "1000 psi", 60.0), "rated_flow"),
        (lambda: eft.servovalve(-1.0, "1000 psi", 60.0), "rated_flow"),
        (lambda: eft.servovalve(1e-3, 7e6), "phase_90_frequency or rise_time"),
        (lambda: eft.servovalve(1e-3, 7e6, 60.0, rise_time=1e-3), "phase_90_frequency or rise_time"),
        (lambda: eft.servovalve(1e-3, 7e6, float("nan")), "phase_90_frequency"),
        (lambda: eft.actuator(stroke=0.2), "force or area"),
        (lambda: eft.actuator("250 kN"), "stroke"),
        (lambda: eft.data_sheets.supply("207 bar", "20 gpm"), "accumulator_volume"),
        (lambda: eft.data_sheets.supply("207 bar", precharge="1 bar"), "precharge"),
        (lambda: eft.data_sheets.supply("207 bar", "20 gpm", "5 gal", "208 bar"), "precharge"),
        (lambda: eft.data_sheets.structure("12 kip", 2.0, 0.02), "mass"),
        (lambda: eft.data_sheets.structure("12 t", 2.0, 2), "damping_ratio = 2: must be below 1.*2 %"),
        (lambda: eft.data_sheets.stories([1e3], [1e6], [3.0]), r"damping_ratios\[0\] = 3.0: must be below 1"),
        (lambda: eft.data_sheets.stories([1e3], [1e6, 1e6], 0.02), "stiffnesses"),
        (lambda: eft.data_sheets.rig(without("structure.mass")), "missing.*structure.mass"),
        (lambda: eft.data_sheets.rig(SHEET | {"pump": {}}), "pump"),
        (lambda: eft.data_sheets.rig(SHEET | {"controller": {"rate": 1.0}}), "controller.rate.*sample_rate"),
        (
            lambda: eft.data_sheets.rig(SHEET | {"actuator": {"force": "250 kg", "stroke": 0.2}}),
            "actuator.force = '250 kg'",
        ),
    ],
)
def test_what_is_wrong_is_named(call, name):
    with pytest.raises(ValueError, match=name):
        call()


def test_a_value_of_a_rig_may_have_a_unit():
    rig = eft.Rig.zhao2005().replace({"structure.mass": "12 t", "supply.pressure": "3000 psi"})
    assert (rig["structure.mass"], rig["supply.pressure"]) == (12000.0, pytest.approx(3000 * PSI))
    with pytest.raises(ValueError, match=r"structure\.mass = \"12 bar\""):
        rig.replace({"structure.mass": "12 bar"})


def test_init_makes_a_rig_of_a_data_sheet(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "sheet.toml", "--data-sheet"]) == 0
    assert main(["init", "rig.toml", "--from-data-sheet", "sheet.toml", "--test"]) == 0
    assert main(["check", "rig.toml"]) in (0, 1)
    Path("mine.toml").write_text(toml(SHEET), encoding="utf-8")
    assert main(["init", "mine-rig.toml", "--from-data-sheet", "mine.toml"]) == 0
    assert (
        eft.Rig.from_toml("mine-rig.toml") == eft.data_sheets.rig(SHEET) == eft.data_sheets.rig("mine.toml")
    )


@pytest.mark.parametrize("key", [question.key for question in eft.data_sheets.QUESTIONS])
def test_init_names_every_key_that_is_missing(key, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(toml(without(key)), encoding="utf-8")
    assert main(["init", "--from-data-sheet", "mine.toml"]) == 2
    said = capsys.readouterr().err
    assert key in said and not Path("rig.toml").exists()
    others = {question.key for question in eft.data_sheets.QUESTIONS} - {key}
    assert not any(f"{other}," in said or f"{other}\n" in said for other in others)


@pytest.mark.parametrize("question", eft.data_sheets.QUESTIONS)
def test_the_example_of_a_question_has_its_unit(question):
    assert quantity(question.key, question.example, question.unit) > 0.0


@pytest.mark.parametrize("right", ["12 t", "12000", "1.2e4 kg"])
def test_init_asks_a_person(right, tmp_path, monkeypatch):
    from click.testing import CliRunner

    from eft.cli import _init

    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(toml(without("structure.mass")), encoding="utf-8")
    monkeypatch.setattr(_init, "sys", type("Sys", (), {"stdin": type("Tty", (), {"isatty": lambda: True})}))
    wrong = ["abc", "26 parsec", "-1 t", "nan", "0", "250 kN"]
    answers = "\n".join([*wrong, f"{right}\n"])
    answer = CliRunner().invoke(_init.init, ["--from-data-sheet", "mine.toml"], input=answers)
    assert answer.exit_code == 0, answer.output
    assert answer.output.count("Error: structure.mass = ") == len(wrong)
    assert "'26 parsec'" in answer.output and "kg, t, tonne" in answer.output
    assert eft.Rig.from_toml("rig.toml")["structure.mass"] == 12000.0


def bode(path, header="frequency (Hz),amplitude (dB),phase (deg)", noise=0.0):
    f = np.geomspace(2.0, 150.0, 30)
    h = 2.0 / (1 + 2 * 0.7j * f / 55 - (f / 55) ** 2)
    rng = np.random.default_rng(1)
    size, angle = 20 * np.log10(abs(h)), np.degrees(np.unwrap(np.angle(h)))
    rows = np.column_stack(
        [f, size + noise * rng.standard_normal(30), angle + 5 * noise * rng.standard_normal(30)]
    )
    Path(path).write_text(header + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()) + "\n")


def test_a_frequency_response_gives_the_valve(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bode("bode.csv")
    assert main(["identify", "valve", "bode.csv", "-o", "valve.toml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["natural_frequency"] == pytest.approx(55.0) and found["damping_ratio"] == pytest.approx(0.7)
    assert found["response_delay"] == pytest.approx(1.4 / (2 * np.pi * 55)) and found["misfit"] < 1e-9
    rig = eft.Rig.zhao2005().replace(found["keys"])
    low, at = spool_response(rig, [1e-3, 55.0])
    assert np.degrees(np.angle(at)) == pytest.approx(-90.0) and abs(at / low) == pytest.approx(1 / 1.4)
    text = Path("valve.toml").read_text()
    assert "[servovalve]" in text and "[compensation]" in text
    bode("noisy.csv", noise=0.2)
    measured = eft.identification.read_frequency_response("noisy.csv")
    assert measured.frequency is measured[0] and measured.amplitude.shape == measured.phase.shape
    noisy = eft.identification.identify_valve(*measured)
    for value, truth in ((noisy.natural_frequency, 55.0), (noisy.damping_ratio, 0.7)):
        assert value.uncertainty > 0.0 and abs(value - truth) < 4 * value.uncertainty


@pytest.mark.parametrize(
    ("header", "name"),
    [("frequency (Hz),amplitude,phase (deg)", "amplitude"), ("frequency (Hz),gain (V),phase (deg)", "V")],
)
def test_a_frequency_response_names_its_units(header, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bode("bode.csv", header)
    assert main(["identify", "valve", "bode.csv"]) == 2
    assert name in capsys.readouterr().err


def test_a_frequency_response_may_have_decimal_commas(tmp_path):
    bode(tmp_path / "bode.csv")
    expected = eft.identification.read_frequency_response(tmp_path / "bode.csv")
    text = (tmp_path / "bode.csv").read_text()
    for separator in (";", "\t"):
        (tmp_path / "comma.csv").write_text(text.replace(",", separator).replace(".", ","))
        found = eft.identification.read_frequency_response(tmp_path / "comma.csv")
        assert np.array_equal(found, expected)


def test_a_frequency_response_in_another_unit_is_refused(tmp_path):
    bode(tmp_path / "bode.csv")
    frequency, amplitude, phase = eft.identification.read_frequency_response(tmp_path / "bode.csv")
    with pytest.raises(ValueError, match=r"must be at most 40%: check the units of amplitude and phase"):
        eft.identification.identify_valve(frequency, 10 ** (amplitude / 20), phase)


def test_a_unit_of_another_dimension_is_refused_with_the_ones_that_fit():
    with pytest.raises(ValueError, match="26 kip") as refused:
        eft.data_sheets.structure("26 kip", "2 Hz", "2 %")
    assert all(unit in str(refused.value) for unit in ("mass", "kg", "t", "lb", "slug"))


def test_the_keys_have_plain_numbers():
    keys = eft.servovalve("15 gpm", "1000 psi", rise_time="5 ms", full_step_time="12 ms")
    values = [*keys.values(), *keys["servovalve.flow_table.flows"]]
    assert {type(value) for value in values} == {float, list}
