"""Self-calibration in long tests and after failures: the results on the evidence page."""

from pathlib import Path

import pytest

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
# Case: largest force error, largest error of the flow gain after 5 s, longest time without learning (s).
BOUNDS = {
    "supply falls by 20 % in 60 s, 8.9 kN": (0.02, 0.02, 0.0),
    "velocity lost for 10 ms": (0.02, 0.005, 0.2),
    "velocity lost for 50 ms": (0.06, 0.005, 0.2),
    "20 kN, the valve saturates": (0.3, 0.005, 0.0),
    "supply transducer stuck, supply falls": (0.02, 0.04, 0.0),
}


@pytest.fixture
def evidence(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(EVIDENCE))
    import learning_lasts

    return learning_lasts


@pytest.mark.parametrize("name", BOUNDS)
def test_outcome(evidence, name: str) -> None:
    row = next(case for case in evidence.cases() if case.name == name).row()
    error, flow_gain, still = BOUNDS[name]
    assert float(row["force error"].rstrip("%")) / 100 <= error, row
    assert float(row["flow gain, largest error after 5 s"]) <= flow_gain, row
    assert float(row["time without learning"].rstrip(" s")) <= still, row
    assert row["ends"] == "completed", row


@pytest.mark.parametrize("name", ["supply transducer lost", "supply transducer lost, protection on"])
def test_a_lost_supply_transducer_leaves_its_last_reading_and_a_flag(evidence, name: str) -> None:
    import eft

    case = next(case for case in evidence.cases() if case.name == name)
    run, row = case.run(), case.row()
    after = run.time > evidence.FAULT + 0.01
    assert (run.status[after] & eft.Status.STUCK_MEASUREMENT != 0).all()
    assert (run.status & eft.Status.INVALID_MEASUREMENT == 0).all()
    assert float(row["force error"].rstrip("%")) <= 2.0, row
    assert row["time without learning"] == "0.00 s", row
    assert row["ends"] == "completed", row
