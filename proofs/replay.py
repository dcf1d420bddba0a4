"""Evaluates terms for given inputs with exact arithmetic, to check a counterexample."""

from __future__ import annotations

import math
import struct

from bitwuzla import Kind as K
from bitwuzla import Term
from terms import FORMATS

_CODES = {4: ("<f", "<I"), 8: ("<d", "<Q")}


def _size(term: Term) -> int:
    """Bytes of a float."""
    exponent, significand = term.sort().fp_exp_size(), term.sort().fp_sig_size()
    return next(size for size, sizes in FORMATS.items() if sizes == (exponent, significand))


def _from_bits(bits: int, size: int) -> float:
    code, whole = _CODES[size]
    return struct.unpack(code, struct.pack(whole, bits))[0]


def to_bits(x: float, size: int) -> int:
    code, whole = _CODES[size]
    return struct.unpack(whole, struct.pack(code, x))[0]


def rounded(x: float, size: int) -> float:
    """To the nearest float of a size, from a result in double precision, which is exact enough for one operation."""
    if size == 8:
        return x
    try:
        return struct.unpack("<f", struct.pack("<f", x))[0]
    except OverflowError:
        return math.copysign(math.inf, x)


def _quotient(a: float, b: float) -> float:
    if b != 0.0:
        return a / b
    return math.nan if a == 0.0 or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1.0, b)


#: The operations that an execution records, before rounding.
OPERATIONS = {
    "fadd": lambda a, b: a + b,
    "fsub": lambda a, b: a - b,
    "fmul": lambda a, b: a * b,
    "fdiv": _quotient,
    "sqrt": lambda a: math.sqrt(a) if a >= 0.0 or a == 0.0 else math.nan,
}
_FLOATS = {
    K.FP_ADD: "fadd",
    K.FP_SUB: "fsub",
    K.FP_MUL: "fmul",
    K.FP_DIV: "fdiv",
    K.FP_SQRT: "sqrt",
}


def _same(a, b) -> bool:
    """As values: the zeros differ, NaN is NaN."""
    if isinstance(a, float):
        return (math.isnan(a) and math.isnan(b)) or (a == b and math.copysign(1, a) == math.copysign(1, b))
    return a == b


def _signed(word: int, width: int) -> int:
    return word - (1 << width) if word >> (width - 1) else word


def _to_word(x: float, width: int) -> int:
    inside = -(2.0 ** (width - 1)) <= x < 2.0 ** (width - 1)
    return int(x) % (1 << width) if inside else 0


def _words(kind: K, values: list, width: int):
    a, b = values
    table = {
        K.BV_ADD: lambda: a + b, K.BV_SUB: lambda: a - b, K.BV_MUL: lambda: a * b, K.BV_AND: lambda: a & b,
        K.BV_OR: lambda: a | b, K.BV_XOR: lambda: a ^ b, K.BV_SHL: lambda: a << b if b < width else 0,
        K.BV_SHR: lambda: a >> b if b < width else 0,
    }  # fmt: skip
    if kind in table:
        return table[kind]() % (1 << width)
    return {
        K.BV_ULE: lambda: a <= b, K.BV_ULT: lambda: a < b, K.BV_UGE: lambda: a >= b, K.BV_UGT: lambda: a > b,
        K.BV_SLT: lambda: _signed(a, width) < _signed(b, width),
    }[kind]()  # fmt: skip


class Replay:
    """The values of terms, from those of the constants."""

    def __init__(self, known: dict[int, int | float | bool]):
        self.known = known

    def value(self, term: Term):
        left = [term]
        while left:
            here = left[-1]
            if here.id() in self.known:
                left.pop()
                continue
            parts = here.children()
            unknown = [part for part in parts if part.id() not in self.known]
            if unknown:
                left += unknown
            else:
                values = [self.known[part.id()] for part in parts]
                self.known[here.id()] = self._combined(here, parts, values)
        return self.known[term.id()]

    def _combined(self, term: Term, parts, values: list):
        kind = term.kind()
        if kind == K.VALUE:
            return constant(term)
        if kind == K.CONSTANT:
            # What the model says nothing about.
            return 0
        if kind == K.ITE:
            return values[1] if values[0] else values[2]
        if kind in (K.AND, K.OR):
            return all(values) if kind == K.AND else any(values)
        if kind in (K.NOT, K.XOR):
            return not values[0] if kind == K.NOT else values[0] != values[1]
        if kind == K.EQUAL:
            return _same(*values)
        if kind == K.FP_TO_FP_FROM_BV:
            return _from_bits(values[0], _size(term))
        if kind in _FLOATS:
            return rounded(OPERATIONS[_FLOATS[kind]](*values[1:]), _size(term))
        if kind in (K.FP_TO_FP_FROM_FP, K.FP_TO_FP_FROM_UBV):
            return rounded(float(values[1]), _size(term))
        if kind == K.FP_TO_SBV:
            return _to_word(values[1], term.sort().bv_size())
        if kind in _PLAIN:
            return _PLAIN[kind](*values)
        if kind == K.BV_EXTRACT:
            high, low = term.indices()
            return (values[0] >> low) % (1 << (high - low + 1))
        if kind == K.BV_ZERO_EXTEND:
            return values[0]
        if kind == K.BV_CONCAT:
            result = 0
            for part, value in zip(parts, values):
                result = result << part.sort().bv_size() | value
            return result
        return _words(kind, values, parts[0].sort().bv_size())


_PLAIN = {
    K.FP_NEG: lambda a: -a,
    K.FP_ABS: abs,
    K.FP_LEQ: lambda a, b: a <= b,
    K.FP_LT: lambda a, b: a < b,
    K.FP_GEQ: lambda a, b: a >= b,
    K.FP_GT: lambda a, b: a > b,
    K.FP_EQUAL: lambda a, b: a == b,
    K.FP_IS_NAN: math.isnan,
    K.FP_IS_INF: math.isinf,
}


def constant(term: Term):
    """The number or the truth value that a value is."""
    sort = term.sort()
    if sort.is_bool():
        return term.is_true()
    if sort.is_bv():
        return int(term.value(10))
    if sort.is_fp():
        return _from_bits(int("".join(str(part) for part in term.value()), 2), _size(term))
    return None
