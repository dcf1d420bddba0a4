"""A cut of a proof: in the place of some values of a step any values count.

A claim that holds for any values, within what another lemma shows of them, holds for those of the step as well. The
operations before the cut are left out, and so are the premises about them.
"""

from __future__ import annotations

from bitwuzla import Term
from refine import Abstraction, Operation
from terms import Bool, Float, Word, tm


def nearest(abstraction: Abstraction, terms: list[Term]) -> list[Operation]:
    """The operations that some terms contain, without those before them."""
    found, left, seen = [], list(terms), set()
    while left:
        term = left.pop()
        if term.id() in seen:
            continue
        seen.add(term.id())
        if term.id() in abstraction.by_result:
            operation = abstraction.by_result[term.id()]
            if not any(operation is other for other in found):
                found.append(operation)
        else:
            left += term.children()
    return found


class Cut:
    """The operations after the cut."""

    def __init__(self, abstraction: Abstraction, values: list[Float]):
        #: What stands in the place of the values: words, the bits of any float.
        self.unknowns: list[Word] = [Word.any("cut", value.size) for value in values]
        self._replaced = {value.term: new.float().term for value, new in zip(values, self.unknowns)}
        self._all = Abstraction()
        for old in abstraction.operations:
            operands = tuple(self._after(operand) for operand in old.operands)
            new = Operation(old.op, operands, old.result, old.bits, old.height)
            self._all.operations.append(new)
            self._all.by_result[old.result.term.id()] = self._all.by_result[old.bits.id()] = new
        #: Those that the claims and the premises reach.
        self.abstraction = self._all

    def _after(self, value: Float) -> Float:
        return value if value.is_known() else Float(self._of(value.term), value.size)

    def _of(self, term: Term) -> Term:
        return tm.substitute_term(term, self._replaced)

    def through(self, given: list[Bool], assumptions: list[Bool], claims: dict[str, Bool]):
        """The premises and the claims after the cut. Of the assumptions those without operations before it remain."""
        given = [Bool(self._of(formula.term)) for formula in given]
        claims = {name: Bool(self._of(claim.term)) for name, claim in claims.items()}
        reached: dict[int, Operation] = {}
        left = [formula.term for formula in (*given, *claims.values())]
        while left:
            new = [o for o in nearest(self._all, left) if id(o) not in reached]
            reached |= {id(o): o for o in new}
            left = [operand.term for o in new for operand in o.operands]
        operations = [o for o in self._all.operations if id(o) in reached]
        self.abstraction = Abstraction(operations, self._all.by_result)
        rest = [Bool(self._of(formula.term)) for formula in assumptions]
        for formula in rest:
            if all(id(o) in reached for o in nearest(self._all, [formula.term])):
                given.append(formula)
        return given, claims
