"""The kept faults of the studies on the protection agree with the present code, and the pages state them."""

import pytest

import eft
from eft._findings_of_protection import FALSE_ALARMS, SOUND_TESTS
from test_study_pages import DOCS, same

pytestmark = pytest.mark.usefixtures("quick_pictures")


def test_the_kept_early_faults_are_what_the_code_gives(script, monkeypatch):
    study, tables = script("safety_early"), script("safety_rig_tables")
    rigs, kept = tables.read(study.RIGS), tables.read(study.FAULTS)
    # The first rig with faults of all variants.
    failing = [{row["rig"] for row in rows} for rows in tables.early()]
    number = min(map(int, set.intersection(*failing)))
    monkeypatch.setattr(script("safety_random_rigs"), "RUN", (("displacement", "sign"),))
    rows, faults = study.early(number)
    for row, now in zip([row for row in rigs if row["rig"] == str(number)], rows, strict=True):
        same(row, now)
    case = (str(number), "displacement", "sign")
    for row, now in zip(
        [row for row in kept if (row["rig"], row["signal"], row["kind"]) == case], faults, strict=True
    ):
        same(row, now)


def test_the_kept_faults_of_a_load_cell_that_reads_zero_are_what_the_code_gives(script):
    study, tables = script("safety_zero"), script("safety_tables")
    kept = [row for rows in tables.zero().values() for row in rows]
    # The largest force, and the latest without and with a measured load pressure.
    latest = [max(rows, key=lambda row: float(row["time"])) for rows in tables.zero().values()]
    for row in (max(kept, key=lambda row: float(row["force"])), *latest):
        case = (float(row["frequency"]), row["pressure"] == "1", int(row["moment"]))
        now = study.tested(case)
        assert (now["frequency"], now["pressure"], now["moment"]) == (case[0], int(case[1]), case[2])
        for name in ("before", "time", "force"):
            assert now[name] == pytest.approx(float(row[name]), rel=2e-3), name


def test_the_pages_on_the_protection_state_the_kept_faults_of_a_load_cell_that_reads_zero(script):
    tables = script("safety_tables")
    without, measured = tables.zero().values()
    assert len(without) == len(measured) and tables.beyond(measured) == 0
    text, safety = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (DOCS / "safety.md", DOCS.parent / "explanation/safety.md")
    )
    late = [row for row in without if float(row["time"]) > 0.02]
    near = max(abs(float(row["before"])) for row in late) / 1e3
    beyond, of = tables.beyond(without), len(without)
    most, most_measured = (max(float(row["force"]) for row in rows) for rows in (without, measured))
    latest_without, latest = (1e3 * max(float(row["time"]) for row in rows) for rows in (without, measured))
    for page, sentence in (
        (text, f"at {of // 3} moments of a sine of 6 kN"),
        (text, f"begin within {near:.1f} kN of zero force"),
        (text, f"At {beyond} of {of} moments the force exceeded 1.75 times its level"),
        (text, f"its level, with up to {most:.1f} times"),
        (text, f"and every fault was noticed within {latest_without:.0f} ms."),
        (text, f"within {latest:.0f} ms, and the force stayed below {most_measured:.1f} times its level."),
        (safety, f"[At {beyond} of {of} moments]"),
        (safety, f"its level by then, with up to {most:.1f} times. With a measured load pressure none did."),
    ):
        assert sentence in page, sentence


def test_the_kept_tests_with_a_play_are_what_the_code_gives(script):
    study, tables = script("safety_play"), script("safety_sound_tables")
    kept = tables.read(study.PLAY)
    cases = study.drawn_cases(len(kept), study.SEED)
    # At each side a false alarm, and a play without one. A test with a large error multiplies the last bit.
    near = [row for row in kept if float(row["error"]) < 0.15 and row["unwatched"] == "none"]
    false = tables.false_alarms(near)
    for side in study.SIDES:
        sound = (row for row in near if row["cause"] == "none" and float(row["play"]) > 0.0)
        for rows in (false, sound):
            row = next(row for row in rows if row["side"] == side)
            number = int(row["rig"])
            same(row, study.judged(number, cases[number], study.SEED))


def test_the_remark_on_a_play_has_the_kept_counts(script):
    study, tables = script("safety_play"), script("safety_sound_tables")
    for side, alarms in FALSE_ALARMS.items():
        for play in study.PLAYS:
            rows = tables.of_play(play, side)
            assert len(tables.false_alarms(rows)) == alarms.get(play, 0)
            assert len(rows) == SOUND_TESTS


def test_the_pages_on_the_protection_state_the_kept_tests_with_a_play(script):
    study, tables = script("safety_play"), script("safety_sound_tables")
    text, safety, checks = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (
            DOCS / "safety.md",
            *(DOCS.parent / f"explanation/{name}.md" for name in ("safety", "safety-checks")),
        )
    )
    false = {
        side: {play: tables.false_alarms(tables.of_play(play, side)) for play in study.PLAYS}
        for side in study.SIDES
    }
    piston, structure = ([row for rows in of.values() for row in rows] for of in false.values())
    jumped = [row for row in piston if row["jumped"] == "1"]
    of_velocity = sum(row["cause"] == "velocity_implausible" for row in jumped)
    at_end = sum(row["jumped"] == "1" for row in structure)
    assert {row["cause"] for row in structure} == {"force_implausible"}
    assert not any(false[side][0.0] for side in study.SIDES)
    small = [play for play in study.PLAYS if 0.0 < play <= 5e-5]
    assert not any(false["structure"][play] for play in small)
    few, many, at_structure = (
        (len(false[side][play]), len(tables.of_play(play, side)))
        for side, play in (("piston", 2e-5), ("piston", 1e-4), ("structure", 1e-4))
    )
    tests = sum(len(tables.of_play(play, "structure")) for play in study.PLAYS)
    for page, sentence in (
        (text, f"{len(jumped)} of {len(piston)} false alarms are readings beyond"),
        (text, f"of the velocity in {of_velocity} tests, of the force in {len(jumped) - of_velocity}."),
        (text, f"{len(structure)} false alarms blame the force. In {at_end} of these it jumps"),
        (safety, f"[{few[0]} of {few[1]} tests]"),
        (safety, f"and {many[0]} of {many[1]} with 0.1 mm. At the structure none of"),
        (safety, f"none of {sum(len(tables.of_play(play, 'structure')) for play in small)} had one"),
        (safety, f"and {at_structure[0]} of {at_structure[1]} with 0.1 mm. Shim"),
        (checks, f"Of {tests} tests with the motion measured at the structure [two have"),
    ):
        assert sentence in page, sentence


def test_the_pages_on_the_protection_state_the_kept_early_faults(script):
    tables = script("safety_rig_tables")
    variants = tables.early()
    text, safety = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (DOCS / "safety.md", DOCS.parent / "explanation/safety.md")
    )
    (few, of, most), (off, of_off, _), (estimated, of_estimated, largest) = (
        (tables.beyond(rows), len(rows), max(float(row["force"]) for row in rows)) for rows in variants
    )
    of_force = [tables.beyond([row for row in rows if row["signal"] == "force"]) for rows in variants]
    rigs = [len({row["rig"] for row in rows}) for rows in variants]
    for page, sentence in (
        (text, f"Of these {rigs[0]}, {rigs[1]} and {rigs[2]} rigs were"),
        (text, f"in {few} of {of:,} tests, with up to {most:.1f} times. In {of_force[0]} of these"),
        (text, f"up to 2 % off it did in {off} of {of_off:,}, of which {of_force[1]} are the load cell's"),
        (text, f"estimate it did in {estimated} of {of_estimated:,}, with up to {largest:.1f} times."),
        (safety, f"{few} of {of:,} faults within 1.2 s led beyond 1.75 times the level"),
        (safety, f"the level, with up to {most:.1f} times."),
        (safety, f"{off} of {of_off:,}, and with an estimated velocity {estimated} of {of_estimated:,}."),
    ):
        assert sentence in page, sentence
    quiet = [float(row["force"]) for rows in variants for row in rows if row["time"] == "inf"]
    assert round(max(quiet), 2) == 0.79


def test_the_kept_second_faults_are_what_the_code_gives(script):
    study, tables = script("safety_second"), script("safety_rig_tables")
    kept = tables.read(study.SECOND)
    number = kept[0]["rig"]
    for row, now in zip(
        [row for row in kept if row["rig"] == number], study.seconds_of(int(number)), strict=True
    ):
        same(row, now)


def test_the_pages_on_the_protection_state_the_kept_second_faults(script):
    tables, second = script("safety_tables"), script("safety_second")
    rows = tables.read(second.SECOND)
    sensed = [row for row in rows if row["source"] == second.SENSOR]
    estimated = [row for row in rows if row["source"] != second.SENSOR]
    text, safety = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (DOCS / "safety.md", DOCS.parent / "explanation/safety.md")
    )
    rigs = [len({row["rig"] for row in of}) for of in (sensed, estimated)]
    (few, of, most), (more, of_more, largest) = (
        (tables.beyond(of), len(of), max(float(row["force"]) for row in of)) for of in (sensed, estimated)
    )
    sign = tables.beyond([row for row in rows if row["second_kind"] == "sign"])
    for page, sentence in (
        (text, f"allowed {rigs[0]} and {rigs[1]} rigs."),
        (text, f"in {few} of {of:,} tests after the second fault, with up to {most:.1f} times."),
        (text, f"did in {more} of {of_more:,}, with up to {largest:.1f} times. In {sign} of all these"),
        (safety, f"{few} of {of:,} second faults led beyond 1.75 times the level"),
        (safety, f"with an estimated velocity {more} of {of_more:,}."),
    ):
        assert sentence in page, sentence


def test_the_kept_disturbed_readings_are_what_the_code_gives(script):
    study, tables = script("safety_disturbed"), script("safety_tables")
    kept = tables.read(study.DISTURBED)
    # The largest force of each kind.
    for kind in study.SHARES:
        row = max((row for row in kept if row["kind"] == kind), key=lambda row: float(row["force"]))
        case = ((row["signal"], row["pressure"] == "1"), (kind, float(row["share"])), int(row["moment"]))
        same(row, study.tested(case))
    kept = tables.read(study.RIGS)
    number = kept[0]["rig"]
    old = [row for row in kept if row["rig"] == number]
    for row, now in zip(old, study.faults_of(int(number)), strict=True):
        same(row, now)


def test_the_pages_on_the_protection_state_the_kept_disturbed_readings(script):
    study, tables = script("safety_disturbed"), script("safety_tables")
    rows, rigs = tables.read(study.DISTURBED), tables.read(study.RIGS)
    text, safety = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (DOCS / "safety.md", DOCS.parent / "explanation/safety.md")
    )

    def judged(rows, signal, kind, pressure="0", **more):
        of = tables.disturbed(rows, signal, kind, pressure=pressure, **more)
        return of, tables.beyond(of), max(float(row["force"]) for row in of)

    def blamed(rows, cause):
        return sum(row["cause"].endswith(cause) for row in rows)

    def unnoticed(rows):
        return sum(row["time"] == "inf" for row in rows)

    drift, failed, most = judged(rows, "force", "drift")
    of_rigs, rigs_failed, rigs_most = judged(rigs, "force", "drift")
    stroke = eft.Rig.zhao2005()["actuator.stroke"]
    ideal = [moved for *_, moved in study.tests()]
    at_stop = [row for row in drift if float(row["displacement"]) * ideal[int(row["moment"]) % 3] > stroke]
    free = [row for row in drift if row not in at_stop]
    _, _, measured = judged(rows, "force", "drift", "1")
    _, rigs_measured, _ = judged(rigs, "force", "drift", "1")
    dead, dead_failed, dead_most = judged(rigs, "force", "dead")
    small = sum(float(row["command"]) < 0.02 and float(row["force"]) > 1.75 for row in dead)
    velocity, velocity_failed, velocity_most = judged(rows, "velocity", "drift")
    fast, moved_failed, moved_most = judged(rows, "displacement", "drift", share="0.2")
    away, away_failed, away_most = judged(rigs, "displacement", "drift")
    spool, spool_failed, spool_most = judged(rows, "spool", "drift")
    jumps, _, jumps_most = judged(rows, "spool", "offset", share="0.02")
    of_spool, of_force = blamed(jumps, "spool_implausible"), blamed(jumps, "force_implausible")
    of_others = [float(row["force"]) for row in jumps if row["cause"] != "force_implausible"]
    noisy, noisy_failed, noisy_most = judged(rows, "velocity", "noise", share="0.05")
    more, more_failed, _ = judged(rigs, "velocity", "noise", share="0.05")
    others = [judged(rigs, signal, "dead") for signal in ("velocity", "spool")]
    offsets, of_offsets = ([row for row in of if row["kind"] == "offset"] for of in (rows, rigs))
    pressures = [
        row for row in rows if row["signal"] == "load_pressure" and row["kind"] in ("offset", "noise")
    ]
    larger = [row for row in offsets if float(row["share"]) > 0.02]
    for page, sentence in (
        (text, f"allowed {len({row['rig'] for row in rigs})} of {study.COUNT}."),
        (text, f"in {failed} of {len(drift)} tests, in all 60 with 5 %"),
        (
            text,
            f"displacement in {blamed(drift, 'displacement_level')} of {len(drift)} tests, and that of the",
        ),
        (text, f"force in {blamed(drift, 'force_level')}. In {blamed(drift, 'none')} none trips within 6 s."),
        (
            text,
            f"In {len(at_stop)} of the {len(drift)} tests the piston reached an end stop, with "
            f"up to {most:.1f} times the level of the force.",
        ),
        (text, f"In the others it was up to {max(float(row['force']) for row in free):.1f} times."),
        (text, f"watch noticed {blamed(of_rigs, '_implausible')} of {len(of_rigs)}, and {rigs_failed} of"),
        (text, f"{rigs_failed} of {len(of_rigs)} exceeded 1.75 times, with up to {rigs_most:.1f} times."),
        (
            text,
            f"no force exceeded {measured:.2f} times its level on the paper's rig, and {rigs_measured} of",
        ),
        (text, f"did in {dead_failed} of {len(dead)}, with up to {dead_most:.1f} times."),
        (text, f"In {blamed(dead, '_level')} of these {len(dead)} tests only a level tripped."),
        (text, f"small in {small} of the {dead_failed}:"),
        (text, f"a measured load pressure none of {len(dead)} exceeded it."),
        (text, f"in {sum(one[1] for one in others)} of {sum(len(one[0]) for one in others)} tests on"),
        (text, f"with up to {max(one[2] for one in others):.1f} times. - **A velocity"),
        (text, f"blamed in {blamed(velocity, 'displacement_implausible')} of {len(velocity)} tests"),
        (text, f"its level in {moved_failed} of {len(fast)} tests, with {moved_most:.1f} times. On the"),
        (text, f"it did in {away_failed} of {len(away)}, with up to {away_most:.1f} times. In all five"),
        (text, f"in {velocity_failed} of {len(velocity)} tests, with up to {velocity_most:.1f} times at"),
        (text, f"noticed at {unnoticed(jumps)} of 60 moments. The spool was blamed at {of_spool},"),
        (text, f"the load cell at {of_force}. The force reached {jumps_most:.1f} times"),
        (text, f"its level with the load cell blamed, and {max(of_others):.1f} times otherwise."),
        (safety, f"noticed at {unnoticed(jumps)} of 60 moments, and at {of_force} the load cell was blamed."),
        (text, f"in {spool_failed} of {len(spool)} tests, with up to {spool_most:.1f} times."),
        (text, f"in {noisy_failed} of {len(noisy)} tests, with up to {noisy_most:.1f} times"),
        (text, f"On the random rigs {more_failed} of {len(more)} did."),
        (text, f"None of all {len(offsets):,} offsets exceeded 1.6"),
        (text, f"{tables.beyond(of_offsets)} of {len(of_offsets)} exceeded 1.75 times,"),
        (text, f"with up to {max(float(row['force']) for row in of_offsets):.1f} times. - **A failed"),
        (safety, f"[in {failed} of {len(drift)} tests]"),
        (safety, f"end stop in {len(at_stop)}, with up to {most:.1f} times. On random rigs {rigs_failed} of"),
        (text, f"in all but {blamed(pressures, 'force_implausible')} of {len(pressures)} tests."),
        (safety, f"reached {judged(rows, 'velocity', 'noise', share='0.005')[2]:.1f} times its level."),
        (safety, f"On random rigs {dead_failed} of {len(dead)} such faults led"),
        (safety, f"with up to {dead_most:.1f} times, most of them"),
        (safety, f"{velocity_failed + spool_failed} of {len(velocity) + len(spool)} [drifts of these two]"),
    ):
        assert sentence in page, sentence
    assert judged(rigs, "force", "dead", "1")[1] == 0
    assert all(row["cause"] == "displacement_implausible" for row in velocity if float(row["force"]) > 1.75)
    assert all(row["cause"] == "force_implausible" for row in spool if float(row["force"]) > 1.75)
    assert max(float(row["time"]) for row in larger) < 2.45e-3
    assert max(float(row["force"]) for row in offsets) < 1.6
    assert max(float(row["time"]) for row in noisy) < 9e-3
    assert unnoticed(judged(rows, "displacement", "drift", share="0.01")[0]) == 60
    assert unnoticed(judged(rows, "spool", "drift", share="0.01")[0]) == 29
    assert unnoticed(judged(rows, "velocity", "noise", share="0.005")[0]) == 7
    assert unnoticed(judged(rows, "spool", "noise", share="0.005")[0]) == 60


def test_the_kept_faults_at_other_rates_are_what_the_code_gives(script, monkeypatch):
    rates, tables, sizes = script("safety_rates"), script("safety_tables"), script("safety_sizes")
    kept = max(tables.read(rates.RESULTS), key=lambda row: float(row["force"]))
    rate = float(kept["rate"])
    monkeypatch.setattr(sizes.coverage, "RIGS", {kept["size"]: sizes.coverage.RIGS[kept["size"]]})
    case = (kept["signal"], kept["kind"])
    further = {"protection.lost_samples": rates.LOST[rate]}
    (now,) = sizes.sizes(int(kept["moments"]), (case,), rate, further)
    same(kept, {"rate": rate} | now)


def test_the_kept_faults_of_a_swing_are_what_the_code_gives_and_the_pages_state_them(script, monkeypatch):
    study, tables = script("safety_swing"), script("safety_tables")
    kept = tables.read(study.RESULTS)
    worst = max(kept, key=lambda row: float(row["force"]))
    monkeypatch.setattr(study, "GAINS", (float(worst["gain"]),))
    monkeypatch.setattr(study, "FAULTS", ((worst["signal"], worst["kind"]),))
    monkeypatch.setattr(study.coverage, "RIGS", {worst["size"]: study.coverage.RIGS[worst["size"]]})
    (now,) = study.faults(int(worst["moments"]))
    same(worst, now)
    right = max(float(row["force"]) for row in kept if (row["signal"], row["gain"]) == ("velocity", "1"))
    displaced = [row for row in kept if row["signal"] == "displacement"]
    assert tables.beyond(displaced) == 0
    text, safety = (
        " ".join(page.read_text(encoding="utf-8").split())
        for page in (DOCS / "safety.md", DOCS.parent / "explanation/safety.md")
    )
    assert f"the force reaches up to {right:.2f} times its level after a velocity" in text
    assert f"The force reached up to [{right:.2f} times]" in safety
    assert f"{float(worst['gain']):.2f} times the table's flow" in safety
    assert f"[{float(worst['force']):.2f} times]" in safety
    assert f"on the rig of {worst['size']}. At {worst['beyond']} of its {worst['moments']} moments" in safety
