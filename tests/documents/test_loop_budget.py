"""README, change log and docs state the cost of the tick as in the budgets."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
BUDGETS = tomllib.loads((ROOT / "firmware/budgets.toml").read_text(encoding="utf-8"))
# The project's goals for a Cortex-M4F.
GOALS = {
    "compensation_step": 110,
    "paper_tick": 175,
    "self_calibrating_tick": 230,
    "robust_tick": 300,
    "worn_tick": 300,
    "self_calibrating_curve_tick": 230,
    "learner_update": 2300,
    "learner_update, curve": 2300,
    "observer_step": 52,
}


def text(path):
    return " ".join((ROOT / path).read_text(encoding="utf-8").split())


def test_goals_are_met_or_explained():
    for name, goal in GOALS.items():
        assert BUDGETS[name]["goal"] == goal
    for name, budget in BUDGETS.items():
        assert budget["instructions"] <= budget.get("goal", budget["instructions"]) or "why" in budget, name


def test_the_page_is_what_was_measured_last_and_no_budget_is_below_it():
    page = (ROOT / "docs/evidence/loop-budget.md").read_text(encoding="utf-8")
    measured = {}
    for line in page.splitlines():
        if line.startswith("| `"):
            name, *numbers = (cell.strip() for cell in line.strip("|").split("|"))
            measured[name.replace("`", "")] = [int(number) for number in numbers]
    assert measured.keys() == BUDGETS.keys()
    for name, (instructions, code, stack, m33, _) in measured.items():
        budget = BUDGETS[name]
        assert max(instructions, m33) <= budget["instructions"], name
        assert code <= budget["code"] and stack <= budget["stack"], name
    # The measured instructions of the three ways to call a channel, with the budget in brackets.
    for found, budget in re.findall(r"(\d+) \((\d+)\)", page):
        assert any(
            (measured[name][0], BUDGETS[name]["instructions"]) == (int(found), int(budget))
            for name in BUDGETS
        )


def test_every_number_of_instructions_that_a_page_states_is_a_budget():
    known = {
        budget[what] for budget in BUDGETS.values() for what in ("goal", "instructions") if what in budget
    }
    stated = []
    for page in (ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")):
        # The test above checks this page.
        if page.name != "loop-budget.md" and "_" not in {part[0] for part in page.parts[-3:]}:
            words = " ".join(page.read_text(encoding="utf-8").split())
            numbers = re.findall(r"([\d,]*\d) (?:[A-Za-z]+ )?instructions\b", words)
            numbers += re.findall(r"(?:update`?|learner)(?: at most)? ([\d,]*\d)\b", words)
            stated += [(page.name, int(number.replace(",", ""))) for number in numbers]
    assert {page for page, _ in stated} >= {"README.md", "CHANGELOG.md"}
    assert {number for _, number in stated} <= known, stated
