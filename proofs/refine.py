"""Proof by abstraction and refinement.

At first an operation on floats has any result. The solver then looks for a counterexample. Operations whose results in
it are wrong are refined, the nearest to the claim first: by a rule that the counterexample violates, or, if it violates
none, by the exact operation. A counterexample counts only if the exact operations on its inputs violate the claim as
well.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import rounding
from bitwuzla import Bitwuzla, Kind, Option, Options, Result, Term
from terms import Bool, Float, Word, tm

EXACT = {
    "fadd": Float.__add__, "fsub": Float.__sub__, "fmul": Float.__mul__, "fdiv": Float.__truediv__, "sqrt": Float.root,
}  # fmt: skip


@dataclass
class Operation:
    """An operation, and the unknown in its place."""

    op: str
    operands: tuple[Float, ...]
    result: Float
    #: How often it was refined.
    rules: int = 0
    exact: bool = False

    def definition(self) -> Bool:
        exact = EXACT[self.op](*self.operands)
        return Bool(tm.mk_term(Kind.EQUAL, [self.result.term, exact.term]))


@dataclass
class Abstraction:
    """The operations of an execution. The same operation on the same operands has one result."""

    by_result: dict[int, Operation] = field(default_factory=dict)
    _known: dict[tuple, Operation] = field(default_factory=dict)

    def result(self, op: str, operands: tuple[Float, ...]) -> Float:
        key = (op, *(operand.term.id() for operand in operands))
        if key not in self._known:
            # With bits: the exact value may be any NaN.
            bits = Word.any(op, operands[0].size)
            made = self._known[key] = Operation(op, operands, bits.float())
            self.by_result[made.result.term.id()] = self.by_result[bits.term.id()] = made
        return self._known[key].result


@dataclass
class Search:
    """The search for a counterexample to one claim."""

    abstraction: Abstraction
    premises: list[Term]
    claim: Bool
    #: The scalars that may have any value.
    inputs: list[Term]
    seconds: int
    rounds: int = 0

    def run(self) -> tuple[Result, Bitwuzla | None]:
        """Unsatisfiable if the claim is proven, satisfiable with a model that violates it, or unknown."""
        end = time.process_time() + self.seconds
        roots = [*self.premises, (~self.claim).term]
        stored = _stored(self.premises)
        for operation in self.abstraction.by_result.values():
            operation.rules, operation.exact = 0, False
        solver = _solver(self.seconds)
        for root in roots:
            solver.assert_formula(root)
        while (left := end - time.process_time()) > 0:
            result = solver.check_sat()
            if result != Result.SAT:
                return result, None
            if (real := self._replayed(solver, min(left, 20))) is not None:
                return Result.SAT, real
            wrong = self._wrong(solver, roots, stored)
            if not wrong:
                return Result.UNKNOWN, None
            for operation in wrong:
                for formula in self._refined(solver, operation):
                    solver.assert_formula(formula.term)
            self.rounds += 1
        return Result.UNKNOWN, None

    def _replayed(self, solver: Bitwuzla, seconds: float) -> Bitwuzla | None:
        """The exact execution with the inputs of a model, if it violates the claim."""
        exact = _solver(max(1, int(seconds)))
        for value in self.inputs:
            exact.assert_formula(tm.mk_term(Kind.EQUAL, [value, solver.get_value(value)]))
        for operation in self.abstraction.by_result.values():
            exact.assert_formula(operation.definition().term)
        for formula in [*self.premises, (~self.claim).term]:
            exact.assert_formula(formula)
        return exact if exact.check_sat() == Result.SAT else None

    def _wrong(self, solver: Bitwuzla, roots: list[Term], stored: dict[int, Term]) -> list[Operation]:
        """The operations nearest to the claim whose results in the model are wrong."""
        level = roots
        seen: set[int] = set()
        while level:
            reached = _reached(solver, level, stored, self.abstraction, seen)
            wrong = [o for o in reached if not o.exact and not _is_true(solver, o.definition())]
            if wrong:
                return wrong
            level = [operand.term for operation in reached for operand in operation.operands]
        return []

    def _refined(self, solver: Bitwuzla, operation: Operation) -> list[Bool]:
        if operation.rules < 40:
            found = [
                formula
                for formula in rounding.of(solver, operation, self.abstraction)
                if not _is_true(solver, formula)
            ]
            if found:
                operation.rules += 1
                return found
        operation.exact = True
        return [operation.definition()]


def _solver(seconds: int) -> Bitwuzla:
    options = Options()
    options.set(Option.PRODUCE_MODELS, True)
    options.set(Option.TIME_LIMIT_PER, int(seconds * 1000))
    return Bitwuzla(tm, options)


def _is_true(solver: Bitwuzla, formula: Bool) -> bool:
    return solver.get_value(formula.term).is_true()


def _stored(premises: list[Term]) -> dict[int, Term]:
    """The floats whose bits have a name of their own: see `Float.bits`."""
    found = {}
    for premise in premises:
        if premise.kind() == Kind.EQUAL:
            bits, value = premise.children()
            if bits.kind() == Kind.FP_TO_FP_FROM_BV and bits.num_children() == 1:
                found[bits.children()[0].id()] = value
    return found


def _reached(
    solver: Bitwuzla, roots: list[Term], stored: dict[int, Term], abstraction: Abstraction, seen: set[int]
) -> list[Operation]:
    """The operations on which the model's values of some terms depend, up to the next operations."""
    found, left = [], list(roots)
    while left:
        term = left.pop()
        if term.id() in seen:
            continue
        seen.add(term.id())
        if term.id() in abstraction.by_result:
            found.append(abstraction.by_result[term.id()])
        elif term.id() in stored:
            left.append(stored[term.id()])
        else:
            left += _decisive(solver, term)
    return found


def _decisive(solver: Bitwuzla, term: Term) -> list[Term]:
    """The parts of a term that its value in the model depends on."""
    parts, kind = term.children(), term.kind()
    if kind == Kind.ITE:
        condition, yes, no = parts
        return [condition, yes if solver.get_value(condition).is_true() else no]
    if kind in (Kind.AND, Kind.OR):
        # One part decides a conjunction that is false, or a disjunction that is true.
        decides = kind == Kind.OR
        if solver.get_value(term).is_true() == decides:
            return [next(part for part in parts if solver.get_value(part).is_true() == decides)]
    return list(parts)
