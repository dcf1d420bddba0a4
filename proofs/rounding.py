"""Rules of one rounded operation, for a refinement. Their numbers are powers of two next to those of the model.

Each rule follows from two properties of IEEE 754: rounding is monotone, and powers of two scale exactly. `CHECKS` has
the rules at some of these numbers, for a proof with the exact operation.
"""

from __future__ import annotations

import math
import struct

import rules
from bitwuzla import Bitwuzla
from terms import Bool, Float

#: Exponent of the largest power of two of a float, by its size (bytes).
_LARGEST = {2: 15, 4: 127, 8: 1023}


def value(solver: Bitwuzla, of: Float) -> float:
    """A float's value in a model."""
    bits = "".join(str(part) for part in solver.get_value(of.term).value())
    return struct.unpack({2: ">e", 4: ">f", 8: ">d"}[of.size], int(bits, 2).to_bytes(of.size))[0]


def around(x: float, size: int, step: int) -> tuple[int, int]:
    """Exponents of the nearest powers of two below and above a positive number, in multiples of a step."""
    fraction, exponent = math.frexp(x)
    most = _LARGEST[size]
    above = -(-(exponent - (fraction == 0.5)) // step) * step
    below = (exponent - 1) // step * step
    # Their reciprocals are numbers as well.
    return max(min(below, most), -most), max(min(above, most), -most)


def valid(op: str, operands, result: Float) -> list[Bool]:
    """NaN, and signs of quotients and roots."""
    if op == "sqrt":
        (a,) = operands
        return [
            (a >= 0.0).implies(result >= 0.0),
            (a.is_finite() & (a >= 0.0)).implies(result.is_finite()),
        ]
    a, b = operands
    finite = a.is_finite() & b.is_finite()
    said = [(a.is_nan() | b.is_nan()).implies(result.is_nan())]
    if op != "fdiv":
        return [*said, finite.implies(~result.is_nan())]
    for at_least, divided_by in ((a >= 0.0, b > 0.0), (a <= 0.0, b < 0.0)):
        said.append((finite & at_least & divided_by).implies(result >= 0.0))
    for at_least, divided_by in ((a >= 0.0, b < 0.0), (a <= 0.0, b > 0.0)):
        said.append((finite & at_least & divided_by).implies(result <= 0.0))
    return said


def doubled(a: Float, b: Float, result: Float, exponent: int) -> list[Bool]:
    """A sum or difference of numbers within a bound lies within twice the bound."""
    bound = 2.0**exponent
    return [((abs(a) <= bound) & (abs(b) <= bound)).implies(abs(result) <= 2.0 * bound)]


def scaled(a: Float, b: Float, result: Float, exponent: int) -> list[Bool]:
    """A product with a factor on one side of a power of two lies on this side of the product with that power."""
    power = Float.of(2.0**exponent, a.size)
    return [
        (a.is_finite() & (abs(b) <= power)).implies(abs(result) <= abs(a) * power),
        (a.is_finite() & (abs(b) >= power)).implies((abs(result) >= abs(a) * power) | a.equals(0.0)),
    ]


def divided(a: Float, b: Float, result: Float, exponent: int) -> list[Bool]:
    """The same for the divisor of a quotient."""
    power = Float.of(2.0**exponent, a.size)
    return [
        (a.is_finite() & (abs(b) >= power)).implies(abs(result) <= abs(a) / power),
        (a.is_finite() & (abs(b) <= power)).implies((abs(result) >= abs(a) / power) | a.equals(0.0)),
    ]


def _compared(a: Float, b: Float, exponent: int) -> tuple[Bool, Bool]:
    """Whether the ratio of two magnitudes is at most, and at least, a power of two. The larger exponents are exact."""
    power = Float.of(2.0 ** abs(exponent), a.size)
    a, b = (abs(a), abs(b) * power) if exponent >= 0 else (abs(a) * power, abs(b))
    return a <= b, a >= b


def ratio(a: Float, b: Float, result: Float, exponent: int) -> list[Bool]:
    """A quotient of numbers whose ratio is on one side of a power of two lies on this side of it."""
    most, least = _compared(a, b, exponent)
    proper = a.is_finite() & b.is_finite() & ~b.equals(0.0)
    bound = 2.0**exponent
    return [
        (proper & most).implies(abs(result) <= bound),
        (proper & least).implies(abs(result) >= bound),
    ]


def squares(a: Float, c: Float, result: Float, known: Float) -> list[Bool]:
    """The squares of two numbers are in the order of their magnitudes."""
    return [
        (abs(a) <= abs(c)).implies(result <= known),
        (abs(c) <= abs(a)).implies(known <= result),
    ]


def rooted(a: Float, result: Float, exponent: int) -> list[Bool]:
    """The root of a number on one side of an even power of two lies on this side of the power's root."""
    power = 2.0 ** (2 * exponent)
    return [
        (a.within(0.0, power)).implies(result <= 2.0**exponent),
        (a >= power).implies(result >= 2.0**exponent),
    ]


#: Reciprocals between these powers of two are neither too large nor too small to be rounded relatively.
_PLAIN = {2: 10, 4: 100, 8: 1000}
#: Share by which a number must be smaller than another, so that its product with the reciprocal stays below 1.
LESS = {2: 2.0**-7, 4: 2.0**-20, 8: 2.0**-20}


def reciprocal(a: Float, b: Float, result: Float, exponent: int) -> list[Bool]:
    """`a·(1/b)`: as the quotient, for an upper bound. It is less than 1 if `a` is smaller than `b` by a share."""
    most, _ = _compared(a, b, exponent)
    plain = abs(b).within(2.0 ** -_PLAIN[a.size], 2.0 ** _PLAIN[a.size]) & a.is_finite()
    less = LESS[a.size]
    return [
        (plain & most).implies(abs(result) <= 2.0**exponent),
        (plain & (b > 0.0) & (a <= b - b * less)).implies(result <= 1.0 - 0.5 * less),
    ]


def _is_one(x: Float) -> bool:
    return x.is_known() and x.term.id() == Float.of(1.0, x.size).term.id()


def _is_square(operation) -> bool:
    a, b = operation.operands
    return a.term.id() == b.term.id()


def _positive(x: float) -> bool:
    return 0.0 < x < math.inf


def of(solver: Bitwuzla, operation, abstraction) -> list[Bool]:
    """The rules of an operation that a model violates: at first those without numbers, then with coarse ones."""
    op, operands, result = operation.op, operation.operands, operation.result
    rounds = [
        lambda: [
            *valid(op, operands, result),
            *rules.sign(op, operands, result, []),
            *rules.endless(op, operands, result, []),
        ],
        lambda: sized(solver, operation, abstraction, 16),
        lambda: sized(solver, operation, abstraction, 1),
    ]
    for said in rounds:
        if violated := [rule for rule in said() if not solver.get_value(rule.term).is_true()]:
            return violated
    return []


def sized(solver: Bitwuzla, operation, abstraction, step: int) -> list[Bool]:
    """Rules with powers of two around the numbers of a model."""
    op, operands, result = operation.op, operation.operands, operation.result
    size = result.size
    if op == "sqrt":
        x = abs(value(solver, operands[0]))
        halves = {n // 2 for n in around(x, size, 2 * step)} if _positive(x) else ()
        return [formula for n in halves for formula in rooted(*operands, result, n)]
    a, b = operands
    x, y = (abs(value(solver, operand)) for operand in operands)
    if op in ("fadd", "fsub"):
        larger = max(x, y)
        exponent = around(larger, size, step)[1] if _positive(larger) else 0
        said = doubled(a, b, result, exponent) if exponent < _LARGEST[size] else []
        return said + ordered(operation, abstraction)
    if op == "fmul":
        return products(solver, operation, abstraction, step)
    said = []
    if _positive(y):
        said += [formula for exponent in around(y, size, step) for formula in divided(a, b, result, exponent)]
        if _positive(x / y):
            said += [
                formula for exponent in around(x / y, size, step) for formula in ratio(a, b, result, exponent)
            ]
    return said


def ordered(operation, abstraction) -> list[Bool]:
    """With one operand in common, which is no constant, results have the order of the other operands."""
    op, operands = operation.op, operation.operands
    common = {x.term.id() for x in operands if not x.is_known()}
    said = []
    for other in abstraction.operations:
        if other is not operation and other.op == op and common & {x.term.id() for x in other.operands}:
            known = [(other.op, other.operands, other.result)]
            said += rules.monotone(op, operands, operation.result, known)
    return said


def products(solver: Bitwuzla, operation, abstraction, step: int) -> list[Bool]:
    """Those of a product, which may be one with a reciprocal."""
    (a, b), result = operation.operands, operation.result
    size = result.size
    said = rules.never_grows("fmul", (a, b), result, []) + ordered(operation, abstraction)
    if _is_square(operation):
        for other in abstraction.operations:
            if other is not operation and other.op == "fmul" and _is_square(other):
                said += squares(a, other.operands[0], result, other.result)
    for one, other in ((a, b), (b, a)):
        number = abs(value(solver, other))
        if _positive(number):
            said += [
                formula
                for exponent in around(number, size, step)
                for formula in scaled(one, other, result, exponent)
            ]
        made = abstraction.by_result.get(other.term.id())
        if made and made.op == "fdiv" and _is_one(made.operands[0]):
            divisor = made.operands[1]
            number, exact = abs(value(solver, one)), abs(value(solver, divisor))
            exponent = 0
            if _positive(number) and _positive(exact) and _positive(number / exact):
                exponent = around(number / exact, size, step)[1]
            said += reciprocal(one, divisor, result, exponent)
    return said


def _at(exponent: int, rule):
    """A rule at one number, in the form of those of `rules.CHECKS`."""
    return lambda op, operands, result, before: rule(*operands, result, exponent)


def _by_reciprocal(exponent: int):
    def rule(op: str, operands, result: Float, before) -> list[Bool]:
        (a, factor), b = operands, Float.any("divisor", result.size)
        inverse = factor.same(Float.of(1.0, b.size) / b)
        return [inverse.implies(said) for said in reciprocal(a, b, result, exponent)]

    return rule


def _squared(op: str, operands, result: Float, before) -> list[Bool]:
    (a, b), c = operands, Float.any("other", result.size)
    return [a.same(b).implies(said) for said in squares(a, c, result, c * c)]


#: Rule, its name, operations, sizes (bytes).
CHECKS = [
    (lambda op, operands, result, before: valid(op, operands, result), "valid results", ("fadd", "fsub", "fmul", "fdiv", "sqrt"), (4, 8)),
    (_at(3, doubled), "sum of numbers within a bound", ("fadd", "fsub"), (4, 8)),
    *((_at(n, scaled), f"product with a factor near 2^{n}", ("fmul",), (2,)) for n in (-3, 5)),
    *((_at(n, divided), f"quotient by a number near 2^{n}", ("fdiv",), (2,)) for n in (-3, 5)),
    *((_at(n, ratio), f"ratio near 2^{n}", ("fdiv",), (2,)) for n in (-3, 0, 5)),
    *((_at(n, rooted), f"root near 2^{n}", ("sqrt",), (2, 4)) for n in (-3, 3)),
    (_squared, "order of squares", ("fmul",), (2,)),
    *((_by_reciprocal(n), f"product with a reciprocal near 2^{n}", ("fmul",), (2,)) for n in (-3, 0, 5)),
]  # fmt: skip
