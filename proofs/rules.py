"""Rules of rounded arithmetic, for lemmas without the exact operations. Each rule is proven for the exact operation
(`CHECKS`), except that rounding is monotone, which follows from IEEE 754.

A rule is a function of an operation, its operands, its result and the earlier operations; it returns formulas.
"""

from __future__ import annotations

from terms import Bool, Float, all_of


def never_grows(op: str, operands, result: Float, before) -> list[Bool]:
    """A factor within ±1 does not increase the magnitude of a finite number."""
    if op != "fmul":
        return []
    a, b = operands
    return [
        ((abs(b) <= 1.0) & a.is_finite()).implies(abs(result) <= abs(a)),
        ((abs(a) <= 1.0) & b.is_finite()).implies(abs(result) <= abs(b)),
    ]


def sign(op: str, operands, result: Float, before) -> list[Bool]:
    """Adding a number that is not negative does not decrease a sum; signs of differences and products; zero times x."""
    if op not in ("fmul", "fadd", "fsub"):
        return []
    a, b = operands
    finite = a.is_finite() & b.is_finite()
    if op == "fmul":
        return [
            (finite & (a >= 0.0) & (b >= 0.0)).implies(result >= 0.0),
            (finite & (a >= 0.0) & (b <= 0.0)).implies(result <= 0.0),
            (finite & (a <= 0.0) & (b >= 0.0)).implies(result <= 0.0),
            (finite & (a.equals(0.0) | b.equals(0.0))).implies(result.equals(0.0)),
        ]
    if op == "fadd":
        return [
            (finite & (b >= 0.0)).implies(result >= a),
            (finite & (b <= 0.0)).implies(result <= a),
            (finite & b.equals(0.0)).implies(result.equals(a)),
        ]
    return [
        (finite & (a >= b)).implies(result >= 0.0),
        (finite & (b >= 0.0)).implies(result <= a),
        (finite & (b <= 0.0)).implies(result >= a),
    ]


def endless(op: str, operands, result: Float, before) -> list[Bool]:
    """NaN remains NaN. An infinity times a positive number, or minus a finite number, is unchanged."""
    if op not in ("fmul", "fadd", "fsub"):
        return []
    a, b = operands
    said = [(a.is_nan() | b.is_nan()).implies(result.is_nan())]
    for x, k in ((a, b), (b, a)):
        infinite = ~x.is_nan() & ~x.is_finite()
        if op == "fmul":
            said.append((infinite & (k > 0.0)).implies(result.equals(x)))
        if op == "fadd" or (op == "fsub" and x is a):
            said.append((infinite & k.is_finite()).implies(result.equals(x)))
    return said


def stays_finite(op: str, operands, result: Float, before) -> list[Bool]:
    """A finite number plus or minus one within ±10¹² is finite."""
    if op not in ("fadd", "fsub"):
        return []
    a, b = operands
    small = (a.is_finite() & (abs(b) <= 1e12)) | (b.is_finite() & (abs(a) <= 1e12))
    return [small.implies(result.is_finite())]


def monotone(op: str, operands, result: Float, before) -> list[Bool]:
    """With one common operand the larger other operand gives the larger result: for products with a positive factor, for
    sums, and for minuends."""
    if op not in ("fmul", "fadd", "fsub"):
        return []
    said = []
    a, b = operands
    for other, known_operands, known in before:
        if other != op:
            continue
        c, d = known_operands
        # The order of factors and summands does not matter.
        pairs = ((a, b, c, d),) if op == "fsub" else ((a, b, c, d), (b, a, d, c), (a, b, d, c), (b, a, c, d))
        for x, k, y, m in pairs:
            common = k.same(m) & k.is_finite() & ~x.is_nan() & ~y.is_nan()
            if op == "fmul":
                common = common & (k > 0.0)
            said += [
                (common & (x <= y)).implies(result <= known),
                (common & (y <= x)).implies(known <= result),
            ]
    return said


def product(first: float, second: float):
    """A product of numbers within two bounds lies within the product of the bounds."""

    def rule(op: str, operands, result: Float, before) -> list[Bool]:
        if op != "fmul":
            return []
        a, b = operands
        most = first * second
        if a.size < 8 and most >= 2.0**128:
            # No number of this size.
            return []
        return [
            ((abs(a) <= first) & (abs(b) <= second)).implies(abs(result) <= most),
            ((abs(b) <= first) & (abs(a) <= second)).implies(abs(result) <= most),
        ]

    return rule


def total(bound: float):
    """A sum or difference of numbers within a bound lies within twice the bound."""

    def rule(op: str, operands, result: Float, before) -> list[Bool]:
        if op not in ("fadd", "fsub"):
            return []
        a, b = operands
        return [((abs(a) <= bound) & (abs(b) <= bound)).implies(abs(result) <= 2.0 * bound)]

    return rule


_EXACT = {"fdiv": Float.__truediv__, "fmul": Float.__mul__, "fadd": Float.__add__, "fsub": Float.__sub__}
_ALL = ("fmul", "fadd", "fsub")
#: Bounds that the lemmas use.
PRODUCTS = [product(1024.0, 2.0), product(2.0**84, 2.0**39), product(2e12, 1e12)]
TOTALS = [total(bound) for bound in (1.0, 2.0**36, 2.0**37, 2.0**65, 2.0**66)]
DOUBLE = [product(2.0**84, 2.0**68)]

#: Rule, its name, operations, sizes (bytes).
CHECKS = [
    (never_grows, "a factor within ±1 makes nothing larger", ("fmul",), (2,)),
    (sign, "signs", _ALL, (4, 8)),
    (endless, "NaN and infinities", _ALL, (4, 8)),
    (stays_finite, "stays finite", ("fadd", "fsub"), (4, 8)),
    *((rule, f"product within bounds {n}", ("fmul",), (4,)) for n, rule in enumerate(PRODUCTS)),
    *((rule, f"product within larger bounds {n}", ("fmul",), (8,)) for n, rule in enumerate(DOUBLE)),
    *((rule, f"sum within bounds {n}", ("fadd", "fsub"), (4, 8)) for n, rule in enumerate(TOTALS)),
]


def shown(rule, op: str, size: int, broken: bool) -> Bool:
    """The rule for the exact operation, or for another one in its place."""
    a, b = (Float.any(name, size) for name in "ab")
    if op == "sqrt":
        return all_of(rule(op, (a,), a * a if broken else a.root(), []))
    other = Float.__sub__ if op == "fdiv" else Float.__truediv__
    exact = other if broken else _EXACT[op]
    return all_of(rule(op, (a, b), exact(a, b), []))


def in_order(op: str, operands, result: Float, before) -> list[Bool]:
    """`monotone`, with one other operation."""
    (_, b), c = operands, Float.any("other", result.size)
    return monotone(op, operands, result, [(op, (c, b), _EXACT[op](c, b))])


CHECKS += [
    (in_order, "order of sums", ("fadd", "fsub"), (2,)),
]
