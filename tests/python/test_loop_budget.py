"""What README, change log and docs say of the tick's cost is what the budgets hold it to."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
BUDGETS = tomllib.loads((ROOT / "firmware/budgets.toml").read_text(encoding="utf-8"))
STEPS = [
    name
    for name in BUDGETS
    if re.match(r"(eft_)?adaptive_(compensation_)?step(_ahead)?(_f32)?$", name.partition(",")[0])
]


def text(path):
    return " ".join((ROOT / path).read_text(encoding="utf-8").split())


def cost(name, what="instructions"):
    return BUDGETS[name][what]


def test_the_goal_is_met_where_it_is_said_to_be():
    fast = [name for name in STEPS if "," not in name]
    assert len(fast) == 6 and len(STEPS) == 24
    assert max(map(cost, fast)) <= 300
    assert max(cost(name, "stack") for name in STEPS) <= 128
    assert "at most 300 instructions a tick of a microcontroller at 3200 Hz and above" in text("README.md")
    slow, curve = "eft_adaptive_step_ahead_f32, 2048 Hz", "eft_adaptive_step_ahead_f32, curve"
    assert 3200 * cost(slow) < 4096 * cost("eft_adaptive_step_ahead_f32")
    log = text("CHANGELOG.md")
    assert "At most 300 instructions a tick from 3200 Hz up, look-ahead included, in Rust and C" in log
    assert (
        f"below that at most {cost(slow)}, fewer a second than at 4096 Hz; at most 128 bytes of stack" in log
    )
    below = cost("eft_adaptive_step_ahead_f32, curve, 2048 Hz")
    assert f"takes up to {cost(curve)}, below 3200 Hz up to {below}." in log


def test_the_page_on_self_calibration_tells_what_was_measured():
    page = text("docs/adaptive.md")
    both = ("adaptive_step", "eft_adaptive_step_f32")

    def told(between, setting=""):
        rust, c = ([cost(step + setting), cost(step + setting, "stack")] for step in both)
        return f"{rust[0]} instructions and {rust[1]} {between} ({c[0]} and {c[1]} from C)"

    assert told("bytes of stack") in page
    assert told("bytes", ", 2048 Hz") in page
    a_second = [cost(both[1] + ", 2048 Hz") * 2048e-6, cost(both[1]) * 4096e-6]
    assert f"{a_second[0]:.2f} million a second where 4096 Hz takes {a_second[1]:.2f}" in page
    assert "seven instructions more with look-ahead" in page
    for rust, c in (both, [step + ", 2048 Hz" for step in both]):
        assert cost(rust.replace("step", "step_ahead")) == cost(rust) + 7
        assert cost(c.replace("step", "step_ahead")) == cost(c) + 7
    rust, c = ([cost(step + setting) for setting in (", curve", ", curve, 2048 Hz")] for step in both)
    assert f"{rust[0]} instructions a tick ({c[0]} from C; at 2048 Hz {rust[1]} and {c[1]})" in page
