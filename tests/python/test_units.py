"""One table of units: rigs, data sheets, records and measurements read the same unit in the same way."""

import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import eft
from eft.traces._units import to_si

RIG = eft.Rig.zhao2005()
VALVE = ("90 gpm", "1000 psi", "60 Hz")

# By SI unit: a column, a key of the rig with a value in its range, and the same value through a data sheet.
READERS = {
    "m": ("displacement", "actuator.stroke", 0.1, lambda x: eft.actuator("9 kN", x)["actuator.stroke"] * 2.0),
    "N": (
        "force", "actuator.friction", 50.0,
        lambda x: eft.actuator("9 kN", "1 m", friction=x)["actuator.friction"],
    ),
    "Pa": ("load_pressure", "supply.pressure", 2e7, lambda x: eft.data_sheets.supply(x)["supply.pressure"]),
    "m³/s": (
        "flow", "servovalve.pilot_flow_limit", 1e-3,
        lambda x: eft.data_sheets.supply("207 bar", x, "5 gal")["supply.pump_flow"],
    ),
    "s": (
        "time", "servovalve.pilot_time_constant", 1e-3,
        lambda x: 1e-7 / eft.servovalve(*VALVE, full_step_time=x)["servovalve.pilot_flow_limit"],
    ),
    "V": (
        "valve_command", "limits.valve_command", 8.0,
        lambda x: 1.0 / eft.servovalve(*VALVE, rated_signal=x)["compensation.valve_gain"],
    ),
    "": (
        "spool", "servovalve.overlap", 0.01,
        lambda x: eft.servovalve(*VALVE, overlap=x)["servovalve.overlap"],
    ),
    "m/s": ("velocity", "sensors.velocity.noise", 1e-3, None),
    "m/s²": ("acceleration", "sensors.acceleration.noise", 1e-3, None),
}  # fmt: skip
MEANT_IN_COLUMNS = {("N", "lb"): "lbf", ("N", "lbs"): "lbf", ("m/s²", "gal"): "Gal", ("m/s²", "gals"): "Gal"}
"""Names with another meaning where a column names a force or an acceleration."""

WORDS = {
    "m": "m cm mm µm um in inch inches ft foot",
    "s": "s sec second ms msec us microsecond min minute h hour",
    "N": "N kN MN mN kgf tf lbf lb kip",
    "Pa": "Pa kPa MPa mPa bar psi ksi",
    "m³": "L l litre mL gal Gal gallon",
    "m³/s": "gpm lpm m3ps",
    "m/s": "mps inps",
    "m/s²": "g gal Gal gals mps2 ms-2",
    "V": "V volt mV",
    "": "% percent 1 -",
    "other": "kg t Hz W hp foo",
}


def spelled(*kinds):
    """Names of units of some kinds, in any letter case, as plurals and as abbreviations."""
    words = [word for kind in kinds for word in WORDS[kind].split()]
    cases = st.sampled_from([str, str, str, str.upper, str.lower, str.title])
    ends = st.sampled_from(["", "", "", "s", "."])
    return st.builds(lambda word, case, end: case(word) + end, st.sampled_from(words), cases, ends)


def joined(*parts):
    """Texts one after the other; a text is one of several."""
    return st.builds(
        lambda *texts: "".join(texts), *(st.sampled_from(p) if isinstance(p, list) else p for p in parts)
    )


PER = ["/", " / ", " "]
POWER = ["", "", "2", "²", "^3", "**2", "-1", "⁻²"]
ANY = joined(["", "", "sq ", "cu. "], spelled(*WORDS), POWER)
COMPOSED = {
    "Pa": joined(spelled("N"), PER, ["", "sq ", "sq. "], spelled("m"), ["", "2", "²"]),
    "m³/s": joined(["", "cu "], spelled("m", "m³"), ["", "3", "^3"], PER, spelled("s"), ["", "-1"]),
    "m/s": joined(spelled("m"), PER, spelled("s"), ["", "-1", "⁻¹"]),
    "m/s²": joined(spelled("m"), PER, spelled("s"), ["/s", "2", "²", "^2", "**2", "-2", "⁻²"]),
}


def units_for(si):
    """An SI unit, and a unit that often has its dimension."""
    own = COMPOSED.get(si, spelled(si)) | spelled(si)
    return st.tuples(st.just(si), own | ANY | joined(ANY, [*PER, "·", "-", "*"], ANY))


def by_column(column, unit):
    """One of a unit in a column of measurements, in SI; None if it is refused."""
    try:
        return to_si(column, unit)
    except ValueError:
        return None


@given(st.sampled_from(list(READERS)).flatmap(units_for))
@example(("m", "Inch"))
@example(("N", "KIPS"))
@example(("Pa", "PSI"))
@example(("m³/s", "GPM"))
@example(("m³/s", "l / min"))
@example(("m/s²", "Gal"))
@example(("", "12"))
def test_every_reader_reads_a_unit_alike(drawn):
    si, unit = drawn
    column, key, value, by_sheet = READERS[si]
    unit = MEANT_IN_COLUMNS.get((si, unit.lower().strip(".")), unit)
    factor = by_column(column, unit)
    readers = [lambda text: RIG.replace({key: text})[key], *([by_sheet] if by_sheet else [])]
    for read in readers:
        if factor is None:
            with pytest.raises(ValueError, match="must be"):
                read(f"{value!r} {unit}")
        else:
            assert read(f"{value / factor!r} {unit}") == pytest.approx(value, rel=1e-9)


@given(units_for("m/s²"))
@example(("m/s²", "GAL"))
def test_a_record_reads_a_unit_as_a_column_does(tmp_path_factory, drawn):
    unit = drawn[1]
    path = tmp_path_factory.getbasetemp() / "a.txt"
    path.write_text("0.0\n1.0\n")
    factor = by_column("acceleration", unit)
    if factor is None:
        with pytest.raises(ValueError, match="must be a unit of acceleration"):
            eft.read_record(path, dt=0.01, unit=unit)
    else:
        assert eft.read_record(path, dt=0.01, unit=unit).pga == factor


@pytest.mark.parametrize(
    ("key", "text", "units"),
    [
        ("actuator.piston_area", "12.73 squin", "m², cm², mm², in², sq in"),
        ("actuator.friction", "3 lb", "N, kN, MN, kgf, tf, lbf, kip"),
        ("supply.pressure", "3000 mpa", "Pa, kPa, MPa, GPa, bar, psi, ksi, kgf/cm2"),
        ("supply.pump_flow", "20 gal", "m³/s, gpm, lpm, L/s, L/min, in³/s"),
        ("structure.stiffness", "4 kip", "N/m, kN/m, N/mm, kN/mm, lbf/in, kip/in"),
    ],
)
def test_an_error_names_text_key_and_units(key, text, units):
    with pytest.raises(ValueError, match=re.escape(f'{key} = "{text}": must be a number ')) as error:
        RIG.replace({key: text})
    assert f"such as {units}" in str(error.value)


def test_brackets_without_end_are_refused():
    with pytest.raises(ValueError, match=r"structure\.mass"):
        RIG.replace({"structure.mass": "1 " + "(" * 200_000})
