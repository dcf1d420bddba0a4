"""The learner."""

from __future__ import annotations

from lemma import Case, Formulas, Lemma, Twin

from lemmas.bounds import nothing, untouched


def control_shows(v: Case) -> Formulas:
    c, s, after, out = v.config, v.state, v.after["state"], v.after["out"]
    lost = ~v.window.lost.same(0)
    fixed = c.adapts.same(0)
    sums = [path for path in s.evidence.all()]
    kept = {path: value for path, value in s.evidence.all().items()}
    return {
        "the calibration is that of the window": out.window.same(v.window.number),
        "without adaptation the estimates keep their bits": fixed.implies(
            untouched(s.flow, after.flow) & untouched(s.valve.found, after.valve.found)
        ),
        "a window with a lost sample leaves the sums": lost.implies(
            untouched(s.evidence.flow, after.evidence.flow)
        ),
    }


LEMMAS = [
    Lemma("learner, any state and window", "learner", nothing, control_shows, Twin(swap=("icmp ult", "icmp ugt")), refined=True),
]
