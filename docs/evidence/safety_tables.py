"""Tables of the page on faults and false alarms, from the files that the scripts on safety write."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from safety import BRAKED, CASES, FAULTS, PRESSURES, RESPONSES, SUPPLIES, YIELDING
from safety_disturbed import CASES as CASES_OF_DISTURBED
from safety_disturbed import DISTURBED, FAILING, SHARES
from safety_disturbed import RIGS as DISTURBED_RIGS
from safety_estimates import ESTIMATES, SOURCES
from safety_null import BIASES, NULL
from safety_rates import RESULTS as RATES
from safety_sizes import SIZES
from safety_swing import RESULTS as SWING
from safety_zero import ZERO

from eft._files import write_text

BEYOND = 1.75
"""The force over its level that counts as a failure."""
LATE = 0.6
"""The time (s) after which a fault counts as not noticed."""
Row = dict[str, str]


def read(path: Path) -> list[dict[str, str]]:
    """Rows by column."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def head(*titles: str) -> list[str]:
    """The first two lines of a table."""
    return [f"| {' | '.join(titles)} |", "| --- " * len(titles) + "|"]


def _after(row: dict[str, str]) -> str:
    """Median and worst time to notice a fault."""
    median, worst = 1e3 * float(row["median"]), 1e3 * float(row["worst"])
    return f"{median:.1f} ms, {worst:.0f} ms" if worst < np.inf else "not noticed"


def missed(row: dict[str, str]) -> str:
    """At how many moments a fault was never noticed in time, if its worst moment was not."""
    return f" at {row['unnoticed']} of {row['moments']}" if row["worst"] == "inf" else ""


def _of_null_bias() -> str:
    """Trips by a load cell: the worst of the schemes, and without a fault the causes."""
    rows = read(NULL)
    sizes = sorted({abs(bias) for bias in BIASES})
    text = ["| load cell | " + " | ".join(f"bias of {100 * size:.0f} %" for size in sizes) + " |"]
    text += ["| --- " * (1 + len(sizes)) + "|"]
    for kind, start in dict.fromkeys((row["kind"], row["start"]) for row in rows):
        cells = []
        for size in sizes:
            found = [
                row
                for row in rows
                if (row["kind"], row["start"], abs(float(row["bias"]))) == (kind, start, size)
            ]
            force, moved, closed = (
                max(float(row[key]) for row in found) for key in ("force", "displacement", "closed")
            )
            alarm = " (alarm)" if kind == "none" and {row["causes"] for row in found} != {"none"} else ""
            later = "" if kind == "none" else f", closed {closed / 1e3:.1f} kN"
            cells.append(f"{force / 1e3:.1f} kN, {1e3 * moved:.0f} mm{later}{alarm}")
        moment = "at the first sample" if start == "0" else "from 3 s on"
        name = "sound" if kind == "none" else f"{'lost' if kind == 'lost' else 'wrong sign'} {moment}"
        text.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join([*text, ""])


def zero() -> dict[str, list[Row]]:
    """The faults of a load cell that reads zero, without ("0") and with ("1") a measured load pressure."""
    rows = read(ZERO)
    return {measured: [row for row in rows if row["pressure"] == measured] for measured in "01"}


def _of_zero() -> str:
    """How late such a load cell is noticed, and the largest force, at each frequency."""
    text = [
        "| load pressure | sine | after 20 ms or more | noticed after: median, worst | beyond | largest |"
    ]
    text += ["| --- " * 6 + "|"]
    for measured, rows in zero().items():
        for frequency in dict.fromkeys(row["frequency"] for row in rows):
            found = [row for row in rows if row["frequency"] == frequency]
            times = [float(row["time"]) for row in found]
            worst = "never" if max(times) == np.inf else f"{1e3 * max(times):.0f} ms"
            text.append(
                f"| {'measured' if measured == '1' else '–'} | {frequency} Hz "
                f"| {sum(time >= 0.02 for time in times)} of {len(found)} "
                f"| {1e3 * float(np.median(times)):.1f} ms, {worst} "
                f"| {beyond(found)} | {max(float(row['force']) for row in found):.1f} |"
            )
    return "\n".join([*text, ""])


def disturbed(rows: Sequence[Row], signal: str, kind: str, **more: str) -> list[Row]:
    """The disturbances of a sensor by one kind, with further cells of their rows."""
    wanted = {"signal": signal, "kind": kind} | more
    return [row for row in rows if wanted.items() <= row.items()]


def _of_disturbed() -> str:
    """How many disturbances are noticed and when, the largest force over its level, and how often."""
    rows, of_rigs = read(DISTURBED), read(DISTURBED_RIGS)
    names = [signal + (", pressure measured" if p and signal == "force" else "") for signal, p in FAILING]
    titles = [name.replace("_", " ") for name in names]
    text = head("paper's rig", *titles)
    for kind, share in CASES_OF_DISTURBED:
        per_second = "/s" if kind == "drift" else ""
        name = f"{kind}, {100 * share:g} %{per_second}" if share else kind
        more = {"share": f"{share:.4g}"}
        cells = [noticed(disturbed(rows, one, kind, pressure=str(int(p)), **more)) for one, p in FAILING]
        text.append(f"| {name} | {' | '.join(cells)} |")
    text += ["", *head("random rigs", *titles[:-1])]
    for kind in SHARES:
        cells = [noticed(disturbed(of_rigs, one, kind, pressure=str(int(p)))) for one, p in FAILING[:-1]]
        text.append(f"| {kind} | {' | '.join(cells)} |")
    text += [
        "",
        "A cell has the number of faults that are noticed, the median and the longest time until then, the",
        "largest force over its trip level, and how often it exceeds 1.75.",
    ]
    return "\n".join([*text, ""])


def noticed(rows: Sequence[Row]) -> str:
    """How many faults are noticed, after which time, and the largest force over its level."""
    times = np.array([float(row["time"]) for row in rows])
    seen = 1e3 * times[times < np.inf]
    after = f", {np.median(seen):.1f} ms, {seen.max():.1f} ms" if len(seen) else ""
    force = max(float(row["force"]) for row in rows)
    return f"{len(seen)} of {len(rows)}{after}; {force:.1f}, {beyond(rows)}"


def beyond(rows: Sequence[Row]) -> int:
    """How many faults drove the force beyond."""
    return sum(float(row["force"]) > BEYOND for row in rows)


def by_estimate(rows: Sequence[Row]) -> list[str]:
    """The largest force over its level for each fault and each estimate, and how often it is beyond.

    A row has one moment, or says of how many it is.
    """
    text = ["| sensor, fault | " + " | ".join(SOURCES) + " |", "| --- " * (1 + len(SOURCES)) + "|"]
    for signal, kind in dict.fromkeys(
        (row["signal"], row["kind"]) for row in rows if row["signal"] != "none"
    ):
        cells = []
        for source in SOURCES:
            of = [r for r in rows if (r["source"], r["signal"], r["kind"]) == (source, signal, kind)]
            count = sum(int(row.get("beyond", beyond([row]))) for row in of)
            moments = sum(int(row.get("moments", 1)) for row in of)
            cells.append(f"{max(float(row['force']) for row in of):.1f}; {count} of {moments}")
        text.append(f"| {signal} {kind} | " + " | ".join(cells) + " |")
    return text


def _of_estimates() -> str:
    """The worst of three rigs for each fault and each estimate of the velocity."""
    rows = read(ESTIMATES)
    text = by_estimate(rows)
    alarms = sum(int(row["alarms"]) for row in rows)
    sound = sum(int(row["moments"]) for row in rows if row["signal"] == "none")
    text += [
        "",
        "A cell has the largest force over its trip level, and how often it exceeds 1.75. The tests before",
        f"their fault, and {sound} tests without one, have {alarms} false alarms.",
    ]
    return "\n".join([*text, ""])


def _of_faults() -> str:
    """The faults of the paper's rig, and the transient ones of a yielding specimen."""
    text = head(
        "sensor, fault",
        "scheme",
        "unnoticed",
        "noticed after: median, worst",
        "right sensor named",
        "worst force",
        "beyond 35 kN",
        "worst displacement",
    )
    for row in read(FAULTS):
        text.append(
            f"| {row['signal']} {row['kind']} | {row['scheme']} | {row['unnoticed']} of {row['moments']} "
            f"| {1e3 * float(row['median']):.1f} ms, {1e3 * float(row['worst']):.0f} ms "
            f"| {100 * float(row['blamed']):.0f} % | {float(row['force']) / 1e3:.0f} kN "
            f"| {100 * float(row['beyond']):.1f} % | {1e3 * float(row['displacement']):.0f} mm |"
        )
    text += ["", *head("transient fault of 0.3 to 0.5 s", "ramp of 0.1 s (the default)", "0.05 s")]
    of_fault: dict[str, list[str]] = {}
    for row in read(YIELDING):
        longer = ", 1 s" if row["duration"] == "1" else ""
        of_fault.setdefault(f"{row['signal']} {row['kind']}{longer}", []).append(row["worst"])
    for name, cells in of_fault.items():
        text.append(f"| {name} | " + " | ".join(f"{float(cell):.2f}" for cell in cells) + " |")
    return "\n".join([*text, ""])


def _of_sizes() -> str:
    """The faults on rigs of three sizes."""
    rows = read(SIZES)
    text = head("sensor, fault", *dict.fromkeys(row["size"] for row in rows))
    for signal, kind in CASES:
        cells = [
            f"{_after(row)}{missed(row)}; {float(row['force']):.2f}"
            for row in rows
            if (row["signal"], row["kind"]) == (signal, kind)
        ]
        text.append(f"| {signal} {kind} | " + " | ".join(cells) + " |")
    exceeding, tests = (sum(int(row[key]) for row in rows) for key in ("beyond", "moments"))
    text += [
        "",
        "A cell has the median and the worst time to notice a fault, and the largest force over its trip",
        f"level. The force exceeds 1.75 times the level in {exceeding} of {tests} tests.",
    ]
    return "\n".join([*text, ""])


def _by_size(first: str, groups: dict[str, list[Row]]) -> str:
    """The worst of each group of faults on each rig."""
    sizes = list(dict.fromkeys(row["size"] for rows in groups.values() for row in rows))
    text = head(first, *sizes)
    for name, rows in groups.items():
        cells = []
        for size in sizes:
            of = [row for row in rows if row["size"] == size]
            exceeding, moments = (sum(int(row[key]) for row in of) for key in ("beyond", "moments"))
            cells.append(f"{max(float(row['force']) for row in of):.2f}; {exceeding} of {moments}")
        text.append(f"| {name} | {' | '.join(cells)} |")
    text += ["", "A cell has the largest force over its trip level, and how often it exceeds 1.75."]
    return "\n".join([*text, ""])


def _of_rates() -> str:
    """Faults of velocity and spool at other sample rates."""
    rows = read(RATES)
    rates = dict.fromkeys(row["rate"] for row in rows)
    return _by_size(
        "rate", {f"{float(rate):,.0f} Hz": [row for row in rows if row["rate"] == rate] for rate in rates}
    )


def _of_swing() -> str:
    """Faults at every moment of a swing, with a wrong flow gain."""
    groups: dict[str, list[Row]] = {}
    for row in read(SWING):
        fault = "displacement" if row["signal"] == "displacement" else "velocity of wrong sign"
        groups.setdefault(f"{fault}, flow {float(row['gain']):.2f} times the table's", []).append(row)
    return _by_size("fault", dict(sorted(groups.items())))


def _of_pressures() -> str:
    """Faults of the load cell with a measured load pressure."""
    text = head(
        "force with a measured load pressure",
        "scheme",
        "later than 20 ms",
        "noticed after: median, worst",
        "worst force",
    )
    for row in read(PRESSURES):
        text.append(
            f"| {row['kind']} | {row['scheme']} | {row['late']} of {row['moments']} "
            f"| {_after(row)} | {float(row['force']) / 1e3:.0f} kN |"
        )
    return "\n".join([*text, ""])


def _of_supplies() -> str:
    """A supply that falls, with a transducer that works or fails."""
    text = head("supply", "scheme", "transducer", "force error, rms over rms", "peak force", "trip")
    for row in read(SUPPLIES):
        state = "lost at 3 s" if row["fault"] == "lost" else "sound"
        text.append(
            f"| {row['supply']} | {row['scheme']} | {state} | {100 * float(row['error']):.0f} % "
            f"| {float(row['force']) / 1e3:.1f} kN | {row['cause']} |"
        )
    return "\n".join([*text, ""])


def _of_levels() -> str:
    """Trips by a level, without and with the brake."""
    text = head("specimen, trip by", "`ramp_time`", "displacement: without, with", "force: without, with")
    for row in read(BRAKED):
        text.append(
            f"| {row['specimen']}, {row['signal']} | {row['ramp']} s "
            f"| {float(row['motion_free']):.2f}, {float(row['motion_braked']):.2f} "
            f"| {float(row['force_free']):.2f}, {float(row['force_braked']):.2f} |"
        )
    return "\n".join([*text, ""])


def _of_responses() -> str:
    """The responses to a lost load cell."""
    text = head("after the load cell is lost", "force", "displacement")
    for row in read(RESPONSES):
        force, displacement = float(row["force"]) / 1e3, 1e3 * float(row["displacement"])
        text.append(f"| {row['way']} | {force:.0f} kN | {displacement:.0f} mm |")
    return "\n".join([*text, ""])


TABLES = {
    "faults": _of_faults,
    "sizes": _of_sizes,
    "rates": _of_rates,
    "swing": _of_swing,
    "estimates": _of_estimates,
    "pressures": _of_pressures,
    "supplies": _of_supplies,
    "levels": _of_levels,
    "responses": _of_responses,
    "null": _of_null_bias,
    "zero": _of_zero,
    "disturbed": _of_disturbed,
}


def report(folder: Path) -> None:
    """The generated tables of the page, besides those of random rigs."""
    for name, table in TABLES.items():
        write_text(folder / f"safety_{name}.md", table())
