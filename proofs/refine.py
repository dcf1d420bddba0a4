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
from replay import OPERATIONS, Replay, constant, rounded, to_bits
from terms import Bool, Float, Word, tm

EXACT = {
    "fadd": Float.__add__, "fsub": Float.__sub__, "fmul": Float.__mul__, "fdiv": Float.__truediv__, "sqrt": Float.root,
}  # fmt: skip


#: Number of operations that are refined at once.
AT_ONCE = 3


@dataclass
class Operation:
    """An operation, and the unknown in its place."""

    op: str
    operands: tuple[Float, ...]
    result: Float
    #: Its bits.
    bits: Term
    #: Most operations in a row before it.
    height: int = 0
    exact: bool = False

    def definition(self) -> Bool:
        exact = EXACT[self.op](*self.operands)
        return Bool(tm.mk_term(Kind.EQUAL, [self.result.term, exact.term]))


@dataclass
class Abstraction:
    """The operations of an execution. The same operation on the same operands has one result."""

    operations: list[Operation] = field(default_factory=list)
    by_result: dict[int, Operation] = field(default_factory=dict)
    _known: dict[tuple, Operation] = field(default_factory=dict)
    _heights: dict[int, int] = field(default_factory=dict)

    def result(self, op: str, operands: tuple[Float, ...]) -> Float:
        key = (op, *(operand.term.id() for operand in operands))
        if key not in self._known:
            # With bits: the exact value may be any NaN.
            bits = Word.any(op, operands[0].size)
            made = self._known[key] = Operation(op, operands, bits.float(), bits.term)
            made.height = 1 + max(self._height(operand.term) for operand in operands)
            self.operations.append(made)
            self.by_result[made.result.term.id()] = self.by_result[bits.term.id()] = made
        return self._known[key].result

    def _height(self, term: Term) -> int:
        """Most operations in a row in a term."""
        left = [term]
        while left:
            here = left[-1]
            if here.id() in self._heights:
                left.pop()
                continue
            if here.id() in self.by_result:
                self._heights[here.id()] = self.by_result[here.id()].height
                continue
            parts = here.children()
            unknown = [part for part in parts if part.id() not in self._heights]
            left += unknown
            if not unknown:
                self._heights[here.id()] = max((self._heights[part.id()] for part in parts), default=0)
        return self._heights[term.id()]


@dataclass
class Search:
    """The search for a counterexample to one claim."""

    abstraction: Abstraction
    premises: list[Term]
    #: What was proven before from the same premises.
    proven: list[Term]
    claim: Bool
    #: The scalars that may have any value.
    inputs: list[Term]
    seconds: int
    rounds: int = 0

    def run(self) -> tuple[Result, Bitwuzla | None]:
        """Unsatisfiable if the claim is proven, satisfiable with a model that violates it, or unknown."""
        roots = [*self.premises, (~self.claim).term]
        stored = _stored(self.premises)
        for operation in self.abstraction.operations:
            operation.exact = False
        limit = Limit(self.seconds)
        solver = solver_within(limit)
        for formula in [*roots, *self.proven]:
            solver.assert_formula(formula)
        while not limit():
            result = solver.check_sat()
            if result != Result.SAT:
                return result, None
            if self._is_real(solver):
                return Result.SAT, solver
            refined = self._formulas(solver, roots, stored)
            if not refined:
                return Result.UNKNOWN, None
            for formula in refined:
                solver.assert_formula(formula.term)
            self.rounds += 1
        return Result.UNKNOWN, None

    def _is_real(self, solver: Bitwuzla) -> bool:
        """Whether exact operations on the inputs of a model violate the claim."""
        replay = Replay({known.id(): constant(solver.get_value(known)) for known in self.inputs})
        for o in self.abstraction.operations:
            operands = [replay.value(operand.term) for operand in o.operands]
            exact = rounded(OPERATIONS[o.op](*operands), o.result.size)
            replay.known[o.result.term.id()] = exact
            replay.known[o.bits.id()] = to_bits(exact, o.result.size)
        return all(replay.value(premise) for premise in self.premises) and not replay.value(self.claim.term)

    def _formulas(self, solver: Bitwuzla, roots: list[Term], stored: dict[int, Term]) -> list[Bool]:
        """What refines the model: of the operations nearest to the claim those with the fewest before them. Exact
        products and quotients, which are hard to solve, come last."""
        level, hard = roots, None
        seen: set[int] = set()
        while level:
            reached = _reached(solver, level, stored, self.abstraction, seen)
            wrong = [o for o in reached if not o.exact and not _is_true(solver, o.definition())]
            said: list[Bool] = []
            for operation in sorted(wrong, key=lambda o: o.height)[:AT_ONCE]:
                rules = rounding.of(solver, operation, self.abstraction)
                if rules:
                    said += rules
                elif operation.op in ("fadd", "fsub"):
                    operation.exact = True
                    said.append(operation.definition())
                else:
                    hard = hard or operation
            if said:
                return said
            level = [operand.term for operation in reached for operand in operation.operands]
        if hard:
            hard.exact = True
            return [hard.definition()]
        return []


class Limit:
    """Ends a search after some seconds of the processor."""

    def __init__(self, seconds: float):
        self._end = time.process_time() + seconds

    def __call__(self) -> bool:
        return time.process_time() > self._end


def solver_within(limit: Limit) -> Bitwuzla:
    options = Options()
    options.set(Option.PRODUCE_MODELS, True)
    solver = Bitwuzla(tm, options)
    solver.configure_terminator(limit)
    return solver


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
