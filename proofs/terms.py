"""SMT terms in the notation of arithmetic: IEEE 754 floats, words, truth values."""

from __future__ import annotations

import struct
from functools import reduce

from bitwuzla import Kind as K
from bitwuzla import RoundingMode, Term, TermManager

tm = TermManager()
NEAREST = tm.mk_rm_value(RoundingMode.RNE)
_names = iter(range(10**9))


#: Exponent and significand (bits) of a float by its size (bytes).
FORMATS = {2: (5, 11), 4: (8, 24), 8: (11, 53)}
_CODES = {2: ("<e", "<H"), 4: ("<f", "<I"), 8: ("<d", "<Q")}


def _sort(size: int):
    return tm.mk_fp_sort(*FORMATS[size])


class Bool:
    def __init__(self, term: Term | bool):
        self.term = (tm.mk_true() if term else tm.mk_false()) if isinstance(term, bool) else term

    def __and__(self, other: Bool) -> Bool:
        return Bool(tm.mk_term(K.AND, [self.term, other.term]))

    def __or__(self, other: Bool) -> Bool:
        return Bool(tm.mk_term(K.OR, [self.term, other.term]))

    def __xor__(self, other: Bool) -> Bool:
        return Bool(tm.mk_term(K.XOR, [self.term, other.term]))

    def __invert__(self) -> Bool:
        return Bool(tm.mk_term(K.NOT, [self.term]))

    def implies(self, other: Bool) -> Bool:
        return ~self | other

    def same(self, other: Bool) -> Bool:
        return Bool(tm.mk_term(K.EQUAL, [self.term, other.term]))

    def pick(self, yes, no):
        """`yes` if it is true, else `no`."""
        return yes.chosen(self, no)

    def chosen(self, condition: Bool, no: Bool) -> Bool:
        return Bool(tm.mk_term(K.ITE, [condition.term, self.term, no.term]))


def all_of(parts) -> Bool:
    return reduce(Bool.__and__, parts, Bool(True))


def any_of(parts) -> Bool:
    return reduce(Bool.__or__, parts, Bool(False))


class Word:
    """An unsigned word of `size` bytes."""

    def __init__(self, term: Term, size: int):
        self.term, self.size = term, size

    @classmethod
    def of(cls, value: int, size: int) -> Word:
        return cls(tm.mk_bv_value(tm.mk_bv_sort(8 * size), value & ((1 << (8 * size)) - 1)), size)

    @classmethod
    def any(cls, name: str, size: int) -> Word:
        return cls(tm.mk_const(tm.mk_bv_sort(8 * size), f"{name}!{next(_names)}"), size)

    def _with(self, other: Word | int) -> Word:
        other = Word.of(other, self.size) if isinstance(other, int) else other
        assert other.size == self.size, "words of different sizes"
        return other

    def _op(self, kind: K, other: Word | int) -> Word:
        return Word(tm.mk_term(kind, [self.term, self._with(other).term]), self.size)

    def _test(self, kind: K, other: Word | int) -> Bool:
        return Bool(tm.mk_term(kind, [self.term, self._with(other).term]))

    def __add__(self, other):
        return self._op(K.BV_ADD, other)

    def __sub__(self, other):
        return self._op(K.BV_SUB, other)

    def __mul__(self, other):
        return self._op(K.BV_MUL, other)

    def __and__(self, other):
        return self._op(K.BV_AND, other)

    def __or__(self, other):
        return self._op(K.BV_OR, other)

    def __xor__(self, other):
        return self._op(K.BV_XOR, other)

    def __lshift__(self, other):
        return self._op(K.BV_SHL, other)

    def __rshift__(self, other):
        return self._op(K.BV_SHR, other)

    def __le__(self, other) -> Bool:
        return self._test(K.BV_ULE, other)

    def __lt__(self, other) -> Bool:
        return self._test(K.BV_ULT, other)

    def __ge__(self, other) -> Bool:
        return self._test(K.BV_UGE, other)

    def __gt__(self, other) -> Bool:
        return self._test(K.BV_UGT, other)

    def same(self, other: Word | int) -> Bool:
        return self._test(K.EQUAL, other)

    def signed_less(self, other) -> Bool:
        return self._test(K.BV_SLT, other)

    def chosen(self, condition: Bool, no: Word) -> Word:
        if self.term.id() == no.term.id():
            return self
        return Word(tm.mk_term(K.ITE, [condition.term, self.term, no.term]), self.size)

    def resized(self, size: int) -> Word:
        if size < self.size:
            return Word(tm.mk_term(K.BV_EXTRACT, [self.term], [8 * size - 1, 0]), size)
        if size == self.size:
            return self
        return Word(tm.mk_term(K.BV_ZERO_EXTEND, [self.term], [8 * (size - self.size)]), size)

    def bytes(self, start: int, count: int) -> Word:
        """The bytes from a place in memory on, the lowest first."""
        return Word(tm.mk_term(K.BV_EXTRACT, [self.term], [8 * (start + count) - 1, 8 * start]), count)

    @classmethod
    def joined(cls, parts: list[Word]) -> Word:
        """One after the other in memory."""
        if len(parts) == 1:
            return parts[0]
        size = sum(part.size for part in parts)
        return cls(tm.mk_term(K.BV_CONCAT, [part.term for part in reversed(parts)]), size)

    def bit(self) -> Bool:
        """The lowest bit."""
        return (self & 1).same(1)

    def float(self) -> Float:
        """The float of these bits."""
        return Float(tm.mk_term(K.FP_TO_FP_FROM_BV, [self.term], list(FORMATS[self.size])), self.size, self)

    def as_number(self, size: int) -> Float:
        """The float nearest to the unsigned number."""
        return Float(tm.mk_term(K.FP_TO_FP_FROM_UBV, [NEAREST, self.term], list(FORMATS[size])), size)


class Float:
    """A float of `size` bytes; its bits where they are known, as what is loaded and stored untouched keeps them."""

    def __init__(self, term: Term, size: int, bits: Word | None = None):
        self.term, self.size, self._bits = term, size, bits

    @classmethod
    def of(cls, value: float, size: int) -> Float:
        if size == 1:
            return cls.of(value, 2).resized(1)
        code, whole = _CODES[size]
        return Word.of(struct.unpack(whole, struct.pack(code, value))[0], size).float()

    @classmethod
    def any(cls, name: str, size: int) -> Float:
        return Float(tm.mk_const(_sort(size), f"{name}!{next(_names)}"), size)

    def is_known(self) -> bool:
        """Whether it is a constant."""
        return self._bits is not None and self._bits.term.is_value()

    def bits(self, assume) -> Word:
        """Its bits. Which NaN arithmetic makes is not said by IEEE 754: any."""
        if self._bits is None:
            self._bits = Word.any("bits", self.size)
            assume(Bool(tm.mk_term(K.EQUAL, [self._bits.float().term, self.term])))
        return self._bits

    def _with(self, other: Float | float) -> Float:
        return other if isinstance(other, Float) else Float.of(float(other), self.size)

    def _rounded(self, kind: K, *others: Float | float) -> Float:
        return Float(tm.mk_term(kind, [NEAREST, self.term, *(self._with(o).term for o in others)]), self.size)

    def _test(self, kind: K, other: Float | float) -> Bool:
        return Bool(tm.mk_term(kind, [self.term, self._with(other).term]))

    def __add__(self, other):
        return self._rounded(K.FP_ADD, other)

    def __sub__(self, other):
        return self._rounded(K.FP_SUB, other)

    def __mul__(self, other):
        return self._rounded(K.FP_MUL, other)

    def __truediv__(self, other):
        return self._rounded(K.FP_DIV, other)

    def root(self) -> Float:
        return self._rounded(K.FP_SQRT)

    def __neg__(self) -> Float:
        bits = self._bits and self._bits ^ (1 << (8 * self.size - 1))
        return Float(tm.mk_term(K.FP_NEG, [self.term]), self.size, bits)

    def __abs__(self) -> Float:
        bits = self._bits and self._bits & ((1 << (8 * self.size - 1)) - 1)
        return Float(tm.mk_term(K.FP_ABS, [self.term]), self.size, bits)

    def __le__(self, other) -> Bool:
        return self._test(K.FP_LEQ, other)

    def __lt__(self, other) -> Bool:
        return self._test(K.FP_LT, other)

    def __ge__(self, other) -> Bool:
        return self._test(K.FP_GEQ, other)

    def __gt__(self, other) -> Bool:
        return self._test(K.FP_GT, other)

    def equals(self, other) -> Bool:
        """As numbers: the zeros are equal, NaN is not."""
        return self._test(K.FP_EQUAL, other)

    def same(self, other: Float) -> Bool:
        """Bit for bit where both are known, else as values (all NaN are one)."""
        if self._bits is not None and other._bits is not None:
            return self._bits.same(other._bits)
        return Bool(tm.mk_term(K.EQUAL, [self.term, other.term]))

    def is_nan(self) -> Bool:
        return Bool(tm.mk_term(K.FP_IS_NAN, [self.term]))

    def is_finite(self) -> Bool:
        return ~self.is_nan() & ~Bool(tm.mk_term(K.FP_IS_INF, [self.term]))

    def within(self, lowest, highest) -> Bool:
        return (self >= lowest) & (self <= highest)

    def chosen(self, condition: Bool, no: Float) -> Float:
        if self.term.id() == no.term.id():
            return no if self._bits is None else self
        term = tm.mk_term(K.ITE, [condition.term, self.term, no.term])
        known = self._bits is not None and no._bits is not None
        return Float(term, self.size, condition.pick(self._bits, no._bits) if known else None)

    def resized(self, size: int) -> Float:
        return Float(tm.mk_term(K.FP_TO_FP_FROM_FP, [NEAREST, self.term], list(FORMATS[size])), size)

    def saturated(self) -> Word:
        """As LLVM's `fptosi.sat.i32`: towards zero, the ends beyond them, 0 for NaN."""
        toward_zero = tm.mk_rm_value(RoundingMode.RTZ)
        inside = Word(tm.mk_term(K.FP_TO_SBV, [toward_zero, self.term], [32]), 4)
        limited = (self >= 2.0**31).pick(
            Word.of(2**31 - 1, 4), (self <= -(2.0**31)).pick(Word.of(2**31, 4), inside)
        )
        return self.is_nan().pick(Word.of(0, 4), limited)


_functions: dict[tuple[str, int], Term] = {}


def applied(name: str, *operands: Float) -> Float:
    """An unknown function of floats."""
    size = operands[0].size
    if (name, size) not in _functions:
        sort = tm.mk_fun_sort([_sort(size)] * len(operands), _sort(size))
        _functions[name, size] = tm.mk_const(sort, f"{name}!{size}")
    return Float(tm.mk_term(K.APPLY, [_functions[name, size], *(operand.term for operand in operands)]), size)
