"""The kept faults of random rigs agree with the present code, and the pages state them."""

import pytest

import eft
from test_study_pages import DOCS, same

pytestmark = pytest.mark.usefixtures("quick_pictures")


def faults(script):
    """The tables, the kept rigs with a velocity sensor, their faults, and those with an estimate."""
    study, tables = script("safety_random_rigs"), script("safety_rig_tables")
    rows = tables.read(study.FAULTS)
    sensed = [row for row in rows if row["source"] == study.SENSOR]
    rigs = {row["rig"]: row for row in tables.read(study.RIGS) if row["source"] == study.SENSOR}
    return tables, rigs, sensed, [row for row in rows if row["source"] != study.SENSOR]


def test_the_kept_faults_of_random_rigs_are_what_the_code_gives(script, monkeypatch):
    study, tables = script("safety_random_rigs"), script("safety_rig_tables")
    rigs, kept = tables.read(study.RIGS), tables.read(study.FAULTS)
    # The first rig with each of the three settings, and with faults of an estimate.
    estimated = {row["rig"] for row in kept if row["source"] != study.SENSOR}
    number = next(int(row["rig"]) for row in kept if row["setting"] == "few" and row["rig"] in estimated)
    some = (("force", "sign"), ("velocity", "sign"))
    monkeypatch.setattr(study, "RUN", some)
    for source, settings in ((study.SENSOR, {"usual", "low", "few"}), ("estimate", {"usual"})):
        row, faults = study.faults_of(number, source)
        of_rig = [one for one in rigs if (one["rig"], one["source"]) == (str(number), row["source"])]
        same(of_rig[0], {"rig": number} | row)
        old = [
            one
            for one in kept
            if (one["rig"], one["source"]) == (str(number), row["source"])
            and (one["signal"], one["kind"]) in some
        ]
        assert {one["setting"] for one in faults} == settings
        for one, now in zip(old, faults, strict=True):
            same(one, now)


def test_the_pages_on_the_protection_state_the_kept_faults(script):
    tables, rigs, rows, estimates = faults(script)
    slow, _, _, low, few = (
        [(tables.beyond(half), len(half)) for half in halves]
        for halves in tables.conditions(rigs, rows).values()
    )
    usual = [row for row in rows if row["setting"] == "usual"]
    text, safety, how_to = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (
            DOCS / "safety.md",
            *(DOCS.parent / name for name in ("explanation/safety.md", "how-to/protection.md")),
        )
    )

    def largest(rows, key):
        return max(float(row[key]) for row in rows)

    failed, of_estimates = tables.beyond(usual), tables.beyond(estimates)
    fixed = [row for row in usual if rigs[row["rig"]]["scheme"] == "fixed"]
    assert tables.beyond(fixed) == 0
    for page, sentence in (
        (text, f"in {failed} of the {len(usual):,} tests. All {failed} are self-calibrating"),
        (text, f"the fixed scheme had none in {len(fixed):,}."),
        (text, f"the force reached {largest(usual, 'force'):.1f} times its level"),
        (text, f"and the displacement {largest(usual, 'displacement'):.2f} times"),
        (text, f"of {len(estimates):,} faults were not noticed within 0.6 s."),
        (text, f"its level in {of_estimates} tests, with up to {largest(estimates, 'force'):.1f} times."),
        (text, f"in {low[0][0]} of {low[0][1]} faults, and with an eighth in {low[1][0]} of the same faults"),
        (text, f"of three, {few[0][0]} of {few[0][1]} faults on the random rigs"),
        (text, f"level, and {few[1][0]} with ten."),
        (
            safety,
            f"{slow[0][0]} of {slow[0][1]} faults led beyond 1.75 times the level at a rate below 250 times",
        ),
        (safety, f"and {slow[1][0]} of {slow[1][1]:,} above it."),
        (safety, f"{of_estimates} of {len(estimates):,} faults led beyond 1.75 times the level"),
        (how_to, f"{len(usual) - failed:,} of {len(usual):,} faults stayed below 1.75 times"),
    ):
        assert sentence in page, sentence
    assert largest([row for row in usual if row["kind"] != "gain"], "time") < 0.3235
    assert sum(float(row["time"]) > 0.6 for row in estimates) == 4
    for rows, beyond in ((usual, 1), (estimates, 1)):
        assert sum(float(row["displacement"]) > 1.0 for row in rows) == beyond


def test_the_remarks_on_the_protection_state_the_kept_faults(script):
    tables, rigs, rows, _ = faults(script)
    slow, _, _, low, _ = (
        [100 * tables.beyond(half) / len(half) for half in halves]
        for halves in tables.conditions(rigs, rows).values()
    )
    rig = eft.Rig.zhao2005().replace({"protection.enabled": True, "protection.force_trip": 1e3})
    told = " ".join(eft.check_feasibility(rig, eft.sine_sweep(500.0, 0.5, 3.0, 2.0, 256.0)).reasons)
    for sentence in (
        f"on random rigs {low[0]:.0f} % of the faults of the load cell",
        f"and {low[1]:.1f} % beyond 1.75 times this one.",
        f"on random rigs {slow[0]:.1f} % of the faults drove",
        f"and {slow[1]:.1f} % above it.",
    ):
        assert sentence in told


def test_the_kept_faults_with_the_curve_correction_are_what_the_code_gives(script, monkeypatch):
    study, tables = script("safety_curve"), script("safety_rig_tables")
    rigs, kept = tables.read(study.RIGS), tables.read(study.FAULTS)
    worst = max(kept, key=lambda row: float(row["force"]))
    monkeypatch.setattr(script("safety_random_rigs"), "RUN", ((worst["signal"], worst["kind"]),))
    row, (now,) = study.faults_of(int(worst["rig"]), study.SENSOR, scheme="curve")
    same(next(one for one in rigs if one["rig"] == worst["rig"]), {"rig": int(worst["rig"])} | row)
    same(worst, now)


def test_the_page_states_the_kept_faults_with_the_curve_correction(script):
    study, (tables, rigs, sensed, _) = script("safety_curve"), faults(script)
    kept = tables.read(study.FAULTS)
    assert {row["scheme"] for row in tables.read(study.RIGS)} == {"curve"}
    with_one_gain = [
        row for row in sensed if row["setting"] == "usual" and rigs[row["rig"]]["scheme"] == "adaptive"
    ]
    text = " ".join((DOCS / "safety.md").read_text(encoding="utf-8").split())
    for sentence in (
        f"the default, {len({row['rig'] for row in kept})} of these rigs run",
        f"in {tables.beyond(kept)} of {len(kept):,} tests, with up to",
        f"with up to {max(float(row['force']) for row in kept):.1f} times. With one flow gain",
        f"it did in {tables.beyond(with_one_gain)} of {len(with_one_gain):,}.",
    ):
        assert sentence in text, sentence
