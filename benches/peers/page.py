"""Figures and `docs/evidence/performance.md` from what `run.py` measured: `page.py RESULTS DOCS`."""

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt

GOALS = [
    # what, key, goal, whether less is better
    ("one test: time over that of C", "one over c", 0.6, True),
    ("SciPy `solve_ivp`: time over that of one test", "solve_ivp over one", 500.0, False),
    ("batch on one core: throughput over that of C", "batch throughput over c", 5.5, False),
    ("the same with traces kept", "traces throughput over c", 2.5, False),
    ("the same of adaptive tests", "adaptive throughput over c", 3.0, False),
    ("the same of adaptive tests with noise on every sensor", "noisy throughput over c", 1.5, False),
    (
        "the same of buildings with three stories, a whole building a test",
        "stories throughput over c",
        0.5,
        False,
    ),
    ("one adaptive test: time over that of C's plain one", "adaptive over c", 1.0, True),
    ("batch: two cores over one", "two cores over one", 1.9, False),
    ("C: time over that of numba", "c over numba", 1.1, True),
]

FLOPS = [
    ("propagating the state: 11 columns of 5 numbers", 110),
    ("load flow, softening, demand and their differences", 38),
    ("inputs and output of the controller: force, rates, valve command", 22),
    ("compensation: correction, inverse table, lead network, checks", 25),
    ("metrics", 20),
]
"""Additions, subtractions, multiplications, divisions and roots of one tick of one rig, counted in the
source; comparisons, selections and table look-ups are not counted."""


def number(value):
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def verdict(value, goal, less):
    return "met" if (value <= goal if less else value >= goal) else "**not met**"


def ratios(results):
    lines = ["| quantity | measured | goal | result |", "| --- | --- | --- | --- |"]
    # Results of an older version may lack a row.
    for what, key, goal, less in (row for row in GOALS if row[1] in results):
        value, sign = results[key], "≤" if less else "≥"
        lines.append(f"| {what} | {number(value)} | {sign} {goal:g} | {verdict(value, goal, less)} |")
    many = results["many"]
    what = (
        f"{many['tests']:,} different tests on two cores: time over that of as many in C, one after another"
    )
    lines.append(f"| {what} | 1/{1 / many['ratio']:.3g} | ≤ 1/9 | {verdict(many['ratio'], 1 / 9, True)} |")
    memory = many["memory"]
    what = "their peak memory, MiB"
    lines.append(f"| {what} | {memory:.0f} | < 1024 | {verdict(memory, 1024, True)} |")
    apart = results["side by side"]
    what = f"side by side against alone, {apart['rigs']} rigs: largest relative difference of a metric"
    lines.append(
        f"| {what} | {apart['difference']:.1g} | ≤ 1e-12 | {verdict(apart['difference'], 1e-12, True)} |"
    )
    return lines


def times(results):
    lines = ["| program | ms a test | largest error / peak force |", "| --- | --- | --- |"]
    for who, time in results["milliseconds"].items():
        error = results["errors"].get(who)
        lines.append(f"| {who} | {number(time)} | {'–' if error is None else f'{error:.1e}'} |")
    return lines


def profile():
    parts = json.loads(Path(__file__).parents[1].joinpath("profile.json").read_text())
    lines = ["| part of a tick | one test | a test in a batch |", "| --- | --- | --- |"]
    lines += [f"| {part} | {one:.0f} | {batch:.0f} |" for part, (one, batch) in parts.items()]
    one, batch = (sum(counts) for counts in zip(*parts.values(), strict=True))
    lines.append(f"| together | {one:.0f} | {batch:.0f} |")
    return lines


def limit(results):
    flops = sum(count for _, count in FLOPS)
    per_tick = 1e6 * results["milliseconds"]["eft, batch on one core"] / (32 * 4096)
    rate = flops / per_tick
    lines = ["| part of a tick | floating-point operations |", "| --- | --- |"]
    lines += [f"| {part} | {count} |" for part, count in FLOPS]
    lines += [f"| together | {flops} |", ""]
    lines.append(
        f"A tick of one rig takes {per_tick:.1f} ns in a batch on one core, which is {rate:.1f} · 10⁹ "
        f"operations a second. The same core reaches {results['peak']:.1f} · 10⁹ a second in a loop that "
        f"contains only fused multiplications and additions. The batch reaches {rate / results['peak']:.0%} "
        "of that. Half of its operations are fused, in the propagation. The controller's operations are "
        "not fused, because its bits are the same on every machine. The remaining time has three parts:"
    )
    lines.append("")
    lines.append(
        "- comparisons and selections: the sign in the load pressure's root, limits, flags, checks of "
        "measurements\n"
        "- look-ups in two tables: the rows differ from lane to lane, and each is fetched separately\n"
        "- divisions and roots: a core starts one every few cycles"
    )
    return lines


def text(results):
    many = results["many"]
    sections = [
        "<!-- Made by `make bench` from benches/results.json; do not edit. -->",
        "# Performance",
        "`make bench` measures the package and its peers in one run and makes this page. The test is the "
        "paper's 8.9 kN sweep of 32 s at 4096 Hz with nonlinear compensation, 131,072 ticks. The peers in "
        "`benches/peers` simulate the same rig and controller in a few lines each, without the package. C "
        "is compiled with `-O3 -march=native` and takes one classical Runge–Kutta step a tick, the "
        "smallest possible number. The programs take turns, and a ratio is the median of the ratios of the "
        "rounds. Errors are differences from the converged answer. C with 64 steps a tick agrees with it "
        f"to {results['errors']['C, converged']:.0e}.",
        "\n".join(ratios(results)),
        f"Measured with version {results['version']} on {results['machine']}. "
        f"{results.get('remark', '')}".rstrip(),
        "\n".join(times(results)),
        "`solve_ivp` is called once a tick, because the controller is sampled. Its time is scaled from the "
        "first quarter of a second, and that of JAX from the first two seconds. One test keeps its traces. "
        "A batch keeps metrics, and traces on request, which take additional time to write and return. "
        "The 8.9 MB of a test's traces are in the memory of the test before it. "
        f"The {many['tests']:,} different tests took {many['seconds']:.0f} s. C's time for them is scaled "
        "from 20.",
        "## Accuracy",
        "The default takes one step a tick of the [exponential "
        "method](../explanation/theory.md#stepping-through-time). Its error is below 10⁻⁴ of the peak "
        "force. `method`, `largest_step` and `converged` of `eft.simulate` select another point of these "
        "lines.",
        "![Largest error against time, for the package's two methods and the "
        "peers](images/performance-accuracy.png)",
        "## Growth",
        "Time grows linearly with the duration of a test and with the number of rigs. The floors of a "
        "building run one after another by Runge–Kutta. Their time has a fixed part and a part that grows "
        "with the stories.",
        "![Time against duration, rigs and stories](images/performance-growth.png)",
        "## Where the time goes",
        "The table has the instructions of one tick of one rig with AVX2. `valgrind --tool=callgrind` "
        "counts them over the sweep, by function. `python benches/profile.py benches/profile.json` repeats "
        "the count, which is not part of `make bench`.",
        "\n".join(profile()),
        "\n".join(limit(results)),
        "A single test has one chain of dependent operations from tick to tick. The controller's division, "
        "root and look-up lie between one state and the next. Several tests use this waiting time, eight "
        "to a pair of AVX2 registers or to one AVX-512 register. They run the same code, which is written "
        "for numbers of any width, and give the same bits as a single test. Tests with sensor noise, with "
        "effects beyond the paper's model, and of buildings also run in this way. In tests with "
        "self-calibration the learners run lane by lane once a window. Three parts run lane by lane in every "
        "tick: a protection, an estimate of the velocity, and a controller in single precision.",
    ]
    return "\n\n".join(sections) + "\n"


def figures(results, folder):
    plt.rcParams["svg.hashsalt"] = "eft"
    figure, axes = plt.subplots(figsize=(6.4, 4), layout="constrained")
    names = list(dict.fromkeys(row[0] for row in results["accuracy"]))
    for name, marker in zip(names, "osDx", strict=False):
        rows = [row for row in results["accuracy"] if row[0] == name]
        axes.loglog([row[2] for row in rows], [row[3] for row in rows], marker + "-", label=name)
    axes.axhline(1e-4, color="0.6", linewidth=0.8)
    axes.set(xlabel="time, ms a test", ylabel="largest error / peak force")
    axes.legend()
    figure.savefig(folder / "performance-accuracy.png", dpi=120)
    figure, all_axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
    labels = {"duration": "duration (s)", "rigs": "rigs (2 s each)", "stories": "stories (2 s)"}
    for axes, (key, label) in zip(all_axes, labels.items(), strict=True):
        points = {float(x): y for x, y in results["growth"][key].items()}
        axes.plot(points.keys(), points.values(), "o-")
        axes.set(xlabel=label, ylabel="time (ms)", xlim=(0, None), ylim=(0, None))
    figure.savefig(folder / "performance-growth.png", dpi=120)


def main():
    results = json.loads(Path(sys.argv[1]).read_text())
    docs = Path(sys.argv[2])
    (docs / "performance.md").write_text(text(results))
    (docs / "images").mkdir(exist_ok=True)
    figures(results, docs / "images")
    print("\n".join([*ratios(results), "", *times(results)]))


if __name__ == "__main__":
    main()
