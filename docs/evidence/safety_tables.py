"""Tables of the page on faults and false alarms, from the files that the scripts on safety write."""

import csv
from collections.abc import Callable, Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
from safety import BRAKED, CASES, FAULTS, PRESSURES, RESPONSES, SIGNALS, SUPPLIES, YIELDING
from safety_disturbed import CASES as CASES_OF_DISTURBED
from safety_disturbed import DISTURBED, FAILING, SHARES
from safety_disturbed import RIGS as DISTURBED_RIGS
from safety_early import FAULTS as EARLY_FAULTS
from safety_early import VARIANTS
from safety_estimates import ESTIMATES, SOURCES
from safety_null import BIASES, NULL
from safety_random_rigs import FAULTS as RIG_FAULTS
from safety_random_rigs import LOWEST_RATE, RIGS, RUN, SENSOR
from safety_second import SECOND
from safety_sizes import SIZES
from safety_zero import ZERO

from eft._files import write_text
from eft._findings_of_protection import LEAST_SAMPLES

BEYOND = 1.75
"""The force over its level that counts as a failure."""
LATE = 0.6
"""The time (s) after which a fault counts as not noticed."""
Row = dict[str, str]


def read(path: Path) -> list[dict[str, str]]:
    """Rows by column."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


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
    head = ("paper's rig", *(name.replace("_", " ") for name in names))
    text = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for kind, share in CASES_OF_DISTURBED:
        per_second = "/s" if kind == "drift" else ""
        name = f"{kind}, {100 * share:g} %{per_second}" if share else kind
        more = {"share": f"{share:.4g}"}
        cells = [_noticed(disturbed(rows, one, kind, pressure=str(int(p)), **more)) for one, p in FAILING]
        text.append(f"| {name} | {' | '.join(cells)} |")
    text += ["", f"| random rigs | {' | '.join(head[1:-1])} |", "| --- " * (len(head) - 1) + "|"]
    for kind in SHARES:
        cells = [_noticed(disturbed(of_rigs, one, kind, pressure=str(int(p)))) for one, p in FAILING[:-1]]
        text.append(f"| {kind} | {' | '.join(cells)} |")
    text += [
        "",
        "A cell has the number of faults that are noticed, the median and the longest time until then, the",
        "largest force over its trip level, and how often it exceeds 1.75.",
    ]
    return "\n".join([*text, ""])


def _noticed(rows: Sequence[Row]) -> str:
    """How many faults are noticed, after which time, and the largest force over its level."""
    times = np.array([float(row["time"]) for row in rows])
    seen = 1e3 * times[times < np.inf]
    after = f", {np.median(seen):.1f} ms, {seen.max():.1f} ms" if len(seen) else ""
    force = max(float(row["force"]) for row in rows)
    return f"{len(seen)} of {len(rows)}{after}; {force:.1f}, {beyond(rows)}"


def beyond(rows: Sequence[Row]) -> int:
    """How many faults drove the force beyond."""
    return sum(float(row["force"]) > BEYOND for row in rows)


def _of_faults(rows: Sequence[Row]) -> str:
    """One line per fault."""
    head = ("sensor, fault", "noticed after: median, worst", f"later than {LATE} s", "right sensor named")
    head += ("worst force over its level", f"beyond {BEYOND}")
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for signal, kind in RUN:
        found = [row for row in rows if (row["signal"], row["kind"]) == (signal, kind)]
        times = np.array([float(row["time"]) for row in found])
        cells = (
            f"{signal} {kind}",
            f"{1e3 * np.median(times):.1f} ms, {1e3 * times[times < np.inf].max():.0f} ms",
            f"{(times > LATE).sum()} of {len(found)}",
            f"{sum(row['named'] == '1' for row in found)} of {len(found)}",
            f"{max(float(row['force']) for row in found):.2f}",
            f"{beyond(found)}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def conditions(rigs: dict[str, Row], rows: Sequence[Row]) -> dict[str, tuple[list[Row], list[Row]]]:
    """The faults with and without each condition of the rig, of its levels and of the lost samples."""
    usual = [row for row in rows if row["setting"] == "usual"]

    def split(judge: Callable[[float, float], bool]) -> tuple[list[Row], list[Row]]:
        halves: tuple[list[Row], list[Row]] = ([], [])
        for row in usual:
            rate, own = (float(rigs[row["rig"]][name]) for name in ("sample_rate", "frequency"))
            halves[not judge(rate, own)].append(row)
        return halves

    def pairs(setting: str) -> tuple[list[Row], list[Row]]:
        changed = [row for row in rows if row["setting"] == setting]
        same = {(row["rig"], row["signal"], row["kind"]) for row in changed}
        return changed, [row for row in usual if (row["rig"], row["signal"], row["kind"]) in same]

    return {
        "sample rate below 250 times the natural frequency": split(
            lambda rate, own: rate < LEAST_SAMPLES * own
        ),
        "sample rate of 1,024 Hz, at least 250 times the frequency": split(
            lambda rate, own: LEAST_SAMPLES * own <= rate < LOWEST_RATE
        ),
        "frequency above 7 Hz, and a rate of at least 250 times it": split(
            lambda rate, own: own > 7.0 and rate >= LEAST_SAMPLES * own
        ),
        "load-cell faults, level down to a sixteenth of the capacity": pairs("low"),
        "rate of 1,024 Hz, `lost_samples` of 3 instead of 10": pairs("few"),
    }


def _of_random_rigs() -> str:
    """The faults of random rigs, and how much a condition of the rig or its levels matters."""
    rigs = {row["rig"]: row for row in read(RIGS)}
    every = read(RIG_FAULTS)
    rows = [row for row in every if row["source"] == SENSOR]
    text = [_of_faults([row for row in rows if row["setting"] == "usual"])]
    text += ["| condition | with it | without it |", "| --- | --- | --- |"]
    for name, halves in conditions(rigs, rows).items():
        counts = ((beyond(half), len(half)) for half in halves)
        cells = (f"{count} of {of} ({100 * count / of:.1f} %)" for count, of in counts)
        text.append(f"| {name} | {' | '.join(cells)} |")
    text += ["", *_by_estimate([row for row in every if row["source"] != SENSOR])]
    return "\n".join([*text, ""])


def _by_estimate(rows: Sequence[Row]) -> list[str]:
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


def early() -> list[list[Row]]:
    """The early faults with each null and source of the velocity, in the order of the variants."""
    rows = read(EARLY_FAULTS)
    return [
        [row for row in rows if (float(row["off"]), row["source"] == SENSOR) == (off, source == SENSOR)]
        for source, off in VARIANTS
    ]


def _of_early() -> str:
    """The largest force over its level for each early fault, and how often it is beyond."""
    variants = early()
    head = ("sensor, fault", "noticed after: median, worst", "null up to 0.5 % off", "null up to 2 % off")
    head += ("estimated velocity",)
    text = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for case in RUN:
        cells = []
        for rows in variants:
            of = [row for row in rows if (row["signal"], row["kind"]) == case]
            worst = max((float(row["force"]) for row in of), default=0.0)
            cells.append(f"{worst:.1f}; {beyond(of)} of {len(of)}" if of else "–")
        of = [row for row in variants[0] if (row["signal"], row["kind"]) == case]
        times = np.array([float(row["time"]) for row in of])
        late = f", {(times == np.inf).sum()} not noticed" if np.inf in times else ""
        noticed = f"{1e3 * np.median(times):.1f} ms, {1e3 * times[times < np.inf].max():.0f} ms{late}"
        text.append(f"| {' '.join(case)} | {noticed} | {' | '.join(cells)} |")
    text += ["", "A cell has the largest force over its level, and how often it exceeds 1.75."]
    return "\n".join([*text, ""])


def _of_second() -> str:
    """The largest force over its level after a second fault, and how often it is beyond."""
    rows = read(SECOND)
    head = ("first sensor, second one", "with a velocity sensor", "estimated velocity")
    text = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for pair in permutations(SIGNALS, 2):
        cells = []
        for sensed in (True, False):
            of = [row for row in rows if (row["first"], row["second"]) == pair]
            of = [row for row in of if (row["source"] == SENSOR) == sensed]
            worst = max((float(row["force"]) for row in of), default=0.0)
            cells.append(f"{worst:.1f}; {beyond(of)} of {len(of)}" if of else "–")
        text.append(f"| {', '.join(pair)} | {' | '.join(cells)} |")
    text += [
        "",
        "A cell has the largest force over its level after the second fault, and how often it exceeds 1.75.",
    ]
    return "\n".join([*text, ""])


def _of_estimates() -> str:
    """The worst of three rigs for each fault and each estimate of the velocity."""
    rows = read(ESTIMATES)
    text = _by_estimate(rows)
    alarms = sum(int(row["alarms"]) for row in rows)
    sound = sum(int(row["moments"]) for row in rows if row["signal"] == "none")
    text += [
        "",
        "A cell has the largest force over its trip level, and how often it exceeds 1.75. The tests before",
        f"their fault, and {sound} tests without one, have {alarms} false alarms.",
    ]
    return "\n".join([*text, ""])


def report(folder: Path) -> None:
    """The generated tables of the page."""
    head = "| sensor, fault | scheme | unnoticed | noticed after: median, worst | right sensor named "
    text = [f"{head}| worst force | beyond 35 kN | worst displacement |", "| --- " * 8 + "|"]
    for row in read(FAULTS):
        text.append(
            f"| {row['signal']} {row['kind']} | {row['scheme']} | {row['unnoticed']} of {row['moments']} "
            f"| {1e3 * float(row['median']):.1f} ms, {1e3 * float(row['worst']):.0f} ms "
            f"| {100 * float(row['blamed']):.0f} % | {float(row['force']) / 1e3:.0f} kN "
            f"| {100 * float(row['beyond']):.1f} % | {1e3 * float(row['displacement']):.0f} mm |"
        )
    text += ["", "| transient fault of 0.3 to 0.5 s | ramp of 0.1 s (the default) | 0.05 s |"]
    text += ["| --- " * 3 + "|"]
    of_fault: dict[str, list[str]] = {}
    for row in read(YIELDING):
        longer = ", 1 s" if row["duration"] == "1" else ""
        of_fault.setdefault(f"{row['signal']} {row['kind']}{longer}", []).append(row["worst"])
    for name, cells in of_fault.items():
        text.append(f"| {name} | " + " | ".join(f"{float(cell):.2f}" for cell in cells) + " |")
    write_text(folder / "safety_faults.md", "\n".join([*text, ""]))
    of_size = read(SIZES)
    sizes = list(dict.fromkeys(row["size"] for row in of_size))
    text = ["| sensor, fault | " + " | ".join(sizes) + " |", "| --- " * (1 + len(sizes)) + "|"]
    for signal, kind in CASES:
        cells = [
            f"{_after(row)}{missed(row)}; {float(row['force']):.2f}"
            for row in of_size
            if (row["signal"], row["kind"]) == (signal, kind)
        ]
        text.append(f"| {signal} {kind} | " + " | ".join(cells) + " |")
    beyond, tests = (sum(int(row[key]) for row in of_size) for key in ("beyond", "moments"))
    text += [
        "",
        "A cell has the median and the worst time to notice a fault, and the largest force over its trip",
    ]
    text += [f"level. The force exceeds 1.75 times the level in {beyond} of {tests} tests.", ""]
    write_text(folder / "safety_sizes.md", "\n".join(text))
    write_text(folder / "safety_estimates.md", _of_estimates())
    text = [
        "| force with a measured load pressure | scheme | later than 20 ms | noticed after: median, worst "
    ]
    text[0] += "| worst force |"
    text += ["| --- " * 5 + "|"]
    for row in read(PRESSURES):
        text.append(
            f"| {row['kind']} | {row['scheme']} | {row['late']} of {row['moments']} "
            f"| {_after(row)} | {float(row['force']) / 1e3:.0f} kN |"
        )
    write_text(folder / "safety_pressures.md", "\n".join([*text, ""]))
    text = ["| supply | scheme | transducer | force error, rms over rms | peak force | trip |"]
    text += ["| --- " * 6 + "|"]
    for row in read(SUPPLIES):
        state = "lost at 3 s" if row["fault"] == "lost" else "sound"
        text.append(
            f"| {row['supply']} | {row['scheme']} | {state} | {100 * float(row['error']):.0f} % "
            f"| {float(row['force']) / 1e3:.1f} kN | {row['cause']} |"
        )
    write_text(folder / "safety_supplies.md", "\n".join([*text, ""]))
    text = ["| specimen, trip by | `ramp_time` | displacement: without, with | force: without, with |"]
    text += ["| --- " * 4 + "|"]
    for row in read(BRAKED):
        text.append(
            f"| {row['specimen']}, {row['signal']} | {row['ramp']} s "
            f"| {float(row['motion_free']):.2f}, {float(row['motion_braked']):.2f} "
            f"| {float(row['force_free']):.2f}, {float(row['force_braked']):.2f} |"
        )
    write_text(folder / "safety_levels.md", "\n".join([*text, ""]))
    text = ["| after the load cell is lost | force | displacement |", "| --- " * 3 + "|"]
    for row in read(RESPONSES):
        force, displacement = float(row["force"]) / 1e3, 1e3 * float(row["displacement"])
        text.append(f"| {row['way']} | {force:.0f} kN | {displacement:.0f} mm |")
    write_text(folder / "safety_responses.md", "\n".join([*text, ""]))
    write_text(folder / "safety_null.md", _of_null_bias())
    write_text(folder / "safety_zero.md", _of_zero())
    write_text(folder / "safety_disturbed.md", _of_disturbed())
    write_text(folder / "safety_random_rigs.md", _of_random_rigs())
    write_text(folder / "safety_early.md", _of_early())
    write_text(folder / "safety_second.md", _of_second())
