"""The table's map, and the guarantees of its constructor (`PiecewiseLinear::fill`, `connect` and `index`).

The guarantees hold for all knots and are assumed for the knots that the evaluation reads. The Rust test
`what_the_proofs_take_for_granted` checks the constructor.
"""

from __future__ import annotations

import itertools
from functools import reduce

import rules
from lemma import Case, Formulas, Lemma, Twin
from terms import Float, Word, all_of

CELLS = 62
CROWDED = 255
KNOTS = 21
TABLE_RULES = (rules.sign, rules.endless, rules.stays_finite, rules.monotone)


def _at(index: Word, values: list):
    """The entry with this number, the last one beyond them."""
    result = values[-1]
    for n, value in reversed(list(enumerate(values[:-1]))):
        result = index.same(n).pick(value, result)
    return result


def _abscissa(v: Case, table) -> Float:
    """Where the table is evaluated: what its origin is taken from."""
    return next(a for op, (a, *b), _ in v.run.done if op == "fsub" and b[0].term == table.origin.term)


def evaluation(v: Case, table) -> Float:
    """The value of a row: `value + (x - start)·slope`."""
    x = _abscissa(v, table)
    distances = [
        r for op, (a, *b), r in v.run.done if op == "fsub" and a is x and b[0].term != table.origin.term
    ]
    products = [
        r for op, operands, r in v.run.done if op == "fmul" and any(o is distances[0] for o in operands)
    ]
    return next(
        r for op, operands, r in v.run.done if op == "fadd" and any(o is products[0] for o in operands)
    )


def table_bounds(v: Case, table) -> Formulas:
    rows = [table.rows[n] for n in range(KNOTS)]
    starts, values, slopes = ([getattr(row, name) for row in rows] for name in ("start", "value", "slope"))
    infinite = Float.of(float("inf"), v.size)
    x = _abscissa(v, table)

    def cell(at: Float) -> Word:
        """Counted from 1, like the index in the evaluation."""
        return v.run.compute(
            "fmul", v.run.compute("fsub", at, table.origin), table.cells_per_unit
        ).saturated()

    here = cell(x)
    increasing = all_of(
        (a < b) | (b.equals(infinite) & (a <= infinite)) for a, b in itertools.pairwise(starts)
    )
    # The row of x: the last one that starts at or below it.
    row = reduce(Word.__add__, [(start <= x).pick(Word.of(1, 4), Word.of(0, 4)) for start in starts[1:]])
    start, value, slope = (_at(row, column) for column in (starts, values, slopes))
    next_start, next_value = _at(row + 1, [*starts, infinite]), _at(row + 1, [*values, values[-1]])
    reach = v.run.compute(
        "fadd", value, v.run.compute("fmul", slope, v.run.compute("fsub", next_start, start))
    )
    # The entry of the index for the cell of x.
    entry = _at(here - 1, [table.cells[n] for n in range(CELLS)])
    first = entry.resized(4)
    at_first, over_next = _at(first, starts), _at(first + 2, [*starts, infinite, infinite])
    below_first = Float.any("the largest float below the first knot", v.size)
    return {
        "knots increase": increasing & starts[0].is_finite() & starts[1].is_finite(),
        "scale": (table.cells_per_unit > 0.0)
        & table.cells_per_unit.is_finite()
        & (abs(table.origin) <= 1e13),
        "knots are bounded": all_of((abs(s) <= 1e12) | s.equals(infinite) for s in starts)
        & all_of(abs(value) <= 1e12 for value in values),
        "ends": (table.below <= table.above) & table.below.is_finite() & table.above.is_finite(),
        "values lie between the ends": value.within(table.below, table.above) & (next_value <= table.above),
        "slopes": (slope >= 0.0) & slope.is_finite() & next_start.equals(infinite).implies(slope.equals(0.0)),
        "a segment ends below the next knot": (~next_start.equals(infinite)).implies(
            (reach <= next_value) & (next_start > start)
        ),
        "nothing below the table is inside": (below_first < starts[0])
        & (x < starts[0]).implies(x <= below_first)
        & cell(below_first).signed_less(Word.of(1, 4)),
        "index": entry.same(CROWDED)
        | (
            (entry <= KNOTS - 2)
            & _at(first + 1, [*starts, infinite]).is_finite()
            & (entry.same(0) | cell(at_first).signed_less(here))
            & over_next.is_finite().implies(here.signed_less(cell(over_next)))
        ),
    }


def table_shows(v: Case) -> Formulas:
    return {
        "every abscissa, NaN too: between the table's ends": v.result.within(v.config.below, v.config.above)
    }


def search_given(v: Case) -> Formulas:
    starts = [v.rows[n].start for n in range(KNOTS)]
    infinite = Float.of(float("inf"), v.size)
    increasing = all_of(
        (a < b) | (b.equals(infinite) & (a <= infinite)) for a, b in itertools.pairwise(starts)
    )
    return {"knots increase": increasing & starts[0].is_finite(), "x": (v.x >= starts[0]) & v.x.is_finite()}


def search_shows(v: Case) -> Formulas:
    start = v.after["out"].start
    return {
        "the row starts at or below x": start <= v.x,
        "no later row does": all_of(
            (v.rows[n].start <= v.x).implies(v.rows[n].start <= start) for n in range(KNOTS)
        ),
    }


LEMMAS = [
    Lemma("table, any of up to 21 knots", "table", lambda v: table_bounds(v, v.config), table_shows, Twin(without="index"),
          havoc=frozenset({"fmul", "fadd", "fsub"}), rules=TABLE_RULES, fast=False, hard=True),
    Lemma("table, search by halving", "search", search_given, search_shows, Twin(without="knots increase"), fast=False),
]  # fmt: skip
