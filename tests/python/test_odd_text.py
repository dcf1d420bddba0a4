"""Columns of text as laboratories write them: records and measurements are read, or refused, alike."""

import numpy as np
import pytest

import eft
from eft.traces import read_traces
from eft.traces._units import to_si

VALUES = [0.0, 1.25, -2.5, 0.5, 1.0, -0.5, 0.25, 0.125, 0.75, -1.5]
HEADER = "time (s),acceleration (m/s2)\n"


def rows(between=",", time=1.0, unit=1.0, end="\n"):
    """Rows of time and acceleration, in units of so many s and m/s²."""
    return "".join(f"{i / 100 / time:.8f}{between}{a / unit:.8f}{end}" for i, a in enumerate(VALUES))


def commas(text):
    return text.replace(".", ",")


READ = {
    "blanks": "time (s)  acceleration (m/s2)\n" + rows("   "),
    "single blanks": "time_s acc_g\n" + rows(" ", unit=9.80665),
    "tabs": "time (s)\tacceleration (m/s2)\n" + rows("\t"),
    "semicolons": "time (s);acceleration (m/s2)\n" + rows(";"),
    "decimal commas, semicolons": "time (s);acceleration (m/s2)\n" + commas(rows(";")),
    "decimal commas, tabs": "time (s)\tacceleration (m/s2)\n" + commas(rows("\t")),
    "decimal commas, blanks": "time (s)  acceleration (m/s2)\n" + commas(rows("   ")),
    "quotes": '"time (s)","acceleration (m/s2)"\n' + rows(),
    "quoted decimal commas": '"time (s)";"acceleration (m/s2)"\n'
    + "".join(f'"{row.replace(";", chr(34) + ";" + chr(34))}"\n' for row in commas(rows(";")).split()),
    "line of units": "time,acceleration\ns,m/s2\n" + rows(),
    "line of units in brackets": "time\tacceleration\n(s)\t[m/s2]\n" + rows("\t"),
    "line of other units": "Time;Acceleration\nms;g\n" + rows(";", 1e-3, 9.80665),
    "brackets": "Time [s],Acceleration [m/s^2]\n" + rows(),
    "slash": "Time / s,Acceleration / (m/s2)\n" + rows(),
    "in": "Time in ms,Acceleration in m/s2\n" + rows(time=1e-3),
    "comma before the unit": "Time, s;Acceleration, g\n" + rows(";", unit=9.80665),
    "capitals": HEADER.upper() + rows(),
    "point after a short name": "t (s),acc. (m/s2)\n" + rows(),
    "elapsed time": "Elapsed Time (s),Acceleration (m/s2)\n" + rows(),
    "byte order mark": "\ufeff" + HEADER + rows(),
    "ends of DOS": (HEADER + rows()).replace("\n", "\r\n"),
    "empty lines": "\n\n" + (HEADER + rows()).replace("\n", "\n\n"),
    "comments": "# by us\n" + HEADER + "# more\n" + rows() + "# end\n",
    "comments of MATLAB": "% by us\n" + HEADER + rows(),
    "comments of C": "// by us\n" + HEADER + rows(),
    "separator at each end": HEADER.replace("\n", ",\n") + rows(end=",\n"),
    "separator at the ends of rows": HEADER + rows(end=",\n"),
    "two empty columns at the end": HEADER.replace("\n", ",,\n") + rows(end=",,\n"),
    "empty column": "time (s),,acceleration (m/s2)\n" + rows(",,"),
    "column of words": HEADER.replace("\n", ",note\n") + rows(end=",hello\n"),
    "dates": "date," + HEADER + "".join(f"2026-03-01,{row}\n" for row in rows().split()),
    "dates with points": "date;time (s);acceleration (m/s2)\n"
    + "".join(f"12.3.2004;{row}\n" for row in commas(rows(";")).split()),
    "preamble": "Test 7 of the lab\nOperator: me\n" + HEADER + rows(),
    "preamble with numbers": "Test;7\nDate;12.3.2004\n\ntime (s);acceleration (m/s2)\n" + commas(rows(";")),
    "MTS": "MTS793|ENU|.|/|:|A\n\nData Header:\tTest 7\tTime:\t0.55\tSec\t12/3/2004 10:12:13 AM\n"
    "Data Acquisition\nTime\tAcceleration\t\nSec\tm/s2\t\n" + rows("\t", end="\t\n"),
    "LabVIEW": "LabVIEW\nSeparator\tTab\n***End_of_Header***\t\n\t\nChannels\t1\nX0\t0.0E+0\t\n"
    "Delta_X\t0.01\t\n***End_of_Header***\t\t\nX_Value (s)\tAcceleration (m/s2)\tComment\n" + rows("\t"),
}

TIMES = {
    "s": 1.0, "secs": 1.0, "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3, "us": 1e-6, "µs": 1e-6,
    "microseconds": 1e-6, "min": 60.0, "minutes": 60.0, "h": 3600.0,
}  # fmt: skip
ACCELERATIONS = {
    "g": 9.80665, "G": 9.80665, "g's": 9.80665, "gal": 0.01, "Gals": 0.01, "cm/s²": 0.01, "cm/sec/sec": 0.01,
    "cm/sec**2": 0.01, "mm/s^2": 1e-3, "mm/s/s": 1e-3, "m s-2": 1.0, "m·s⁻²": 1.0, "mps2": 1.0,
    "in/sec2": 0.0254, "ft/s2": 0.3048,
}  # fmt: skip

REFUSED = {
    "another decimal mark in a row": (
        "time (s);acceleration (m/s2)\n0,0;0.1\n0,1;0.2\n",
        r"line 2: both `\.` and `,`",
    ),
    "thousands": ("time (s);acceleration (m/s2)\n0.0;1,250.0\n0.1;1.0\n", r"line 2: both `\.` and `,`"),
    "time of day": ("time (s),acceleration (m/s2)\n10:12:00,1\n10:12:01,2\n", "`10:12:00` is not a number"),
    "two words of one number": (
        HEADER + rows().replace("0.50000000", "0_5"),
        "line 5.*`0_5` is not a number",
    ),
    "hexadecimal": (HEADER + rows().replace("0.50000000", "0x10"), "line 5.*`0x10` is not a number"),
    "typographic minus": (HEADER + rows().replace("-2.5", "−2.5"), "line 4.*is not a number"),
    "not finite": (HEADER + rows().replace("0.50000000", "NaN"), "is not a finite number"),
    "too large": (HEADER + rows().replace("0.50000000", "1e999"), "is not a finite number"),
    "short row": (HEADER + rows().replace("0.05000000,", ""), "line 7: 1 columns"),
    "long row": (HEADER + rows().replace("0.05000000,", "0.05,7,"), "line 7: 3 columns"),
    "lost row": (HEADER + rows().replace("0.05000000,-0.50000000\n", ""), "even"),
    "uneven times": (HEADER + rows().replace("0.0500", "0.0550"), "even"),
    "falling times": (HEADER + rows(time=-1.0), "must increase"),
    "no unit": ("time (s),acceleration\n" + rows(), "`acceleration` names no unit"),
    "unknown unit": ("time (s),acceleration (% g)\n" + rows(), "`?acceleration \\(% g\\)`"),
    "unknown unit of time": (
        "time (ns),acceleration (g)\n" + rows(),
        "unit `ns` of .*time: must be one of s, ms",
    ),
    "two accelerations": (HEADER.replace("\n", ",acceleration (g)\n") + rows(end=",1\n"), "acceleration"),
    "UTF-16": ((HEADER + rows()).encode("utf-16"), "UTF-16"),
    "no text": ((HEADER + rows()).encode("utf-16-le"), "zero bytes"),
    "no rows": (HEADER, "rows|two samples"),
    "a measurement above the names": (rows() + HEADER + rows(), "stand above the names"),
    "nothing": ("", "empty|0 lines"),
}


def answers(path, content):
    """What the two readers make of a file: step (s) and acceleration (m/s²)."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())

    def record():
        found = eft.read_record(path)
        return found.dt, found.acceleration

    def measurement():
        found = read_traces(path)
        return 1.0 / found.sample_rate, found["acceleration"]

    return record, measurement


def check(path, content):
    for answer in answers(path, content):
        step, acceleration = answer()
        assert step == pytest.approx(0.01, rel=1e-5) and acceleration == pytest.approx(
            np.array(VALUES), abs=1e-7
        )


@pytest.mark.parametrize("kind", READ)
def test_both_readers_read(kind, tmp_path):
    check(tmp_path / "a.csv", READ[kind])


@pytest.mark.parametrize("kind", REFUSED)
def test_both_readers_refuse(kind, tmp_path):
    content, says = REFUSED[kind]
    for answer in answers(tmp_path / "a.csv", content):
        with pytest.raises(ValueError, match=says):
            answer()


@pytest.mark.parametrize("unit", TIMES)
def test_both_readers_know_a_unit_of_time(unit, tmp_path):
    check(tmp_path / "a.csv", f"time ({unit}),acceleration (m/s2)\n" + rows(time=TIMES[unit]))


@pytest.mark.parametrize("unit", ACCELERATIONS)
def test_both_readers_know_a_unit_of_acceleration(unit, tmp_path):
    check(tmp_path / "a.csv", f"time (s),acceleration ({unit})\n" + rows(unit=ACCELERATIONS[unit]))


@pytest.mark.parametrize("unit", ["in/sec", "inps", "in s-1", "in·s⁻¹"])
def test_a_unit_of_velocity_in_other_spellings(unit):
    assert to_si("velocity", unit) == pytest.approx(0.0254)
