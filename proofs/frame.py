"""The instructions of one block. The names of the methods `op_...` are those of the instructions."""

from __future__ import annotations

import re
import struct

from ir import Function, Module, Refused
from memory import NULL, SIZES, Access, Pointer, Struct
from terms import Bool, Float, Word

_FAST = re.compile(r"\b(?:fast|nnan|ninf|nsz|arcp|contract|afn|reassoc)\b")
_FLAGS = re.compile(r"\b(?:nuw|nsw|exact|disjoint|nneg|inbounds|samesign)\b ?")
_VALUE = r'(%(?:"[^"]*"|[-\w.$]+)|@(?:"[^"]*"|[-\w.$]+)|ptrtoint \(ptr @\S+ to i32\)|true|false|poison|undef|null|-?\d+(?:\.\d+e[+-]\d+)?|0x[0-9A-F]+)'


class Frame:
    """One block of one call."""

    def __init__(self, run, function: Function, values, here: Bool, structs, edges):
        self.run, self.function, self.values = run, function, values
        self.here, self.structs, self.edges = here, structs, edges
        self.memory = Access(run.obligations, run.assume, here, self.refuse)

    def refuse(self, what: str):
        raise Refused(f"{self.function.name}: {what}")

    # Operands.

    def value(self, kind: str, text: str):
        text = text.strip()
        if text.startswith("%"):
            value = self.values[text]
            if kind in ("float", "double") and isinstance(value, Word):
                return value.float()
            return value
        if text == "null":
            return Pointer(NULL)
        if kind == "ptr" or text.startswith("ptrtoint"):
            # The address of a constant that is not read.
            return Word.any("address", 4)
        if text in ("poison", "undef"):
            # Any value: no claim may depend on it.
            if kind == "i1":
                return Word.any(text, 1).bit()
            return (
                Float.any(text, SIZES[kind]) if kind in ("float", "double") else Word.any(text, SIZES[kind])
            )
        if kind == "i1":
            return Bool(text in ("true", "1"))
        if kind in ("float", "double"):
            number = (
                struct.unpack(">d", int(text, 16).to_bytes(8))[0] if text.startswith("0x") else float(text)
            )
            return Float.of(number, SIZES[kind])
        return Word.of(int(text), SIZES[kind])

    def typed(self, text: str):
        kind, operand = text.split(None, 1)
        return self.value(kind, operand)

    def branches(self, rest: str):
        if match := re.fullmatch(r'label %("[^"]*"|[-\w.$]+)', rest):
            return [(match[1].strip('"'), Bool(True))]
        if match := re.fullmatch(r'(\w+) (\S+), label %("[^"]*"|[-\w.$]+) \[ ?(.*?) ?\]', rest):
            value, left, targets = self.value(match[1], match[2]), Bool(True), []
            for number, label in re.findall(r'\w+ (-?\d+), label %("[^"]*"|[-\w.$]+)', match[4]):
                here = value.same(Word.of(int(number), value.size))
                targets.append((label.strip('"'), here))
                left = left & ~here
            return [*targets, (match[3].strip('"'), left)]
        match = re.fullmatch(rf'i1 {_VALUE}, label %("[^"]*"|[-\w.$]+), label %("[^"]*"|[-\w.$]+)', rest)
        condition = self.value("i1", match[1])
        return [(match[2].strip('"'), condition), (match[3].strip('"'), ~condition)]

    # Instructions.

    def execute(self, instruction) -> None:
        method = getattr(self, f"op_{instruction.op}", None)
        if method is None:
            self.refuse(f"an instruction that is not understood: {instruction.op} {instruction.rest}")
        result = method(instruction.rest)
        if instruction.dest:
            self.values[instruction.dest] = result

    def _pair(self, rest: str):
        if _FAST.search(rest.split("%")[0]):
            self.refuse(f"arithmetic that is not IEEE 754: {rest}")
        match = re.fullmatch(rf"(\w+) {_VALUE}, {_VALUE}", _FLAGS.sub("", rest))
        if not match:
            self.refuse(f"operands that are not understood: {rest}")
        return match[1], self.value(match[1], match[2]), self.value(match[1], match[3])

    def _arithmetic(self, op: str, rest: str):
        _, a, b = self._pair(rest)
        return self.run.compute(op, a, b)

    def op_fadd(self, rest):
        return self._arithmetic("fadd", rest)

    def op_fsub(self, rest):
        return self._arithmetic("fsub", rest)

    def op_fmul(self, rest):
        return self._arithmetic("fmul", rest)

    def op_fdiv(self, rest):
        return self._arithmetic("fdiv", rest)

    def op_fneg(self, rest):
        return -self.typed(rest)

    def op_add(self, rest):
        _, a, b = self._pair(rest)
        return a + b

    def op_sub(self, rest):
        _, a, b = self._pair(rest)
        return a - b

    def op_mul(self, rest):
        _, a, b = self._pair(rest)
        return a * b

    def op_and(self, rest):
        _, a, b = self._pair(rest)
        return a & b

    def op_or(self, rest):
        _, a, b = self._pair(rest)
        return a | b

    def op_xor(self, rest):
        _, a, b = self._pair(rest)
        return a ^ b

    def op_shl(self, rest):
        _, a, b = self._pair(rest)
        return a << b

    def op_lshr(self, rest):
        _, a, b = self._pair(rest)
        return a >> b

    def op_fcmp(self, rest):
        predicate, operands = rest.split(None, 1)
        _, a, b = self._pair(operands)
        unordered = a.is_nan() | b.is_nan()
        plain = {
            "eq": lambda: a.equals(b), "gt": lambda: a > b, "ge": lambda: a >= b,
            "lt": lambda: a < b, "le": lambda: a <= b, "ne": lambda: ~a.equals(b) & ~unordered,
        }  # fmt: skip
        if predicate in ("ord", "uno"):
            return unordered if predicate == "uno" else ~unordered
        result = plain[predicate[1:]]()
        return result | unordered if predicate[0] == "u" else result

    def op_icmp(self, rest):
        predicate, operands = _FLAGS.sub("", rest).split(None, 1)
        kind, a, b = self._pair(operands)
        if kind == "i1":
            return a.same(b) if predicate == "eq" else a ^ b
        if kind == "ptr":
            self.refuse("a comparison of pointers")
        table = {
            "eq": lambda: a.same(b), "ne": lambda: ~a.same(b), "ult": lambda: a < b, "ule": lambda: a <= b,
            "ugt": lambda: a > b, "uge": lambda: a >= b, "slt": lambda: a.signed_less(b),
            "sgt": lambda: b.signed_less(a), "sge": lambda: ~a.signed_less(b), "sle": lambda: ~b.signed_less(a),
        }  # fmt: skip
        return table[predicate]()

    def op_select(self, rest):
        match = re.fullmatch(rf"i1 {_VALUE}, (\w+) {_VALUE}, (\w+) {_VALUE}", rest)
        condition = self.value("i1", match[1])
        yes, no = self.value(match[2], match[3]), self.value(match[4], match[5])
        return condition.pick(yes, no)

    def op_phi(self, rest):
        kind, sources = rest.split(None, 1)
        found = {}
        for value, label in re.findall(rf'\[ {_VALUE}, %("[^"]*"|[-\w.$]+) \]', sources):
            found[label.strip('"')] = value
        result = None
        for label, condition, _ in self.edges:
            value = self.value(kind, found[label])
            result = value if result is None else value.chosen(condition, result)
        return result

    def op_freeze(self, rest):
        return self.typed(rest)

    def op_zext(self, rest):
        match = re.fullmatch(rf"(\w+) {_VALUE} to (\w+)", _FLAGS.sub("", rest))
        value, size = self.value(match[1], match[2]), SIZES[match[3]]
        return value.pick(Word.of(1, size), Word.of(0, size)) if match[1] == "i1" else value.resized(size)

    def op_trunc(self, rest):
        match = re.fullmatch(rf"(\w+) {_VALUE} to (\w+)", _FLAGS.sub("", rest))
        value = self.value(match[1], match[2])
        return value.bit() if match[3] == "i1" else value.resized(SIZES[match[3]])

    def op_uitofp(self, rest):
        match = re.fullmatch(rf"(\w+) {_VALUE} to (\w+)", _FLAGS.sub("", rest))
        return self.value(match[1], match[2]).as_number(SIZES[match[3]])

    def op_fptrunc(self, rest):
        match = re.fullmatch(rf"(\w+) {_VALUE} to (\w+)", rest)
        return self.value(match[1], match[2]).resized(SIZES[match[3]])

    op_fpext = op_fptrunc

    def op_bitcast(self, rest):
        match = re.fullmatch(rf"(\w+) {_VALUE} to (\w+)", rest)
        value = self.value(match[1], match[2])
        return value.bits(self.run.assume) if match[1] in ("float", "double") else value.float()

    # Memory.

    def op_getelementptr(self, rest):
        match = re.fullmatch(rf'(%"[^"]*"|\w+), ptr {_VALUE}, (i\d+) {_VALUE}', _FLAGS.sub("", rest))
        if not match:
            self.refuse(f"an address that is not understood: {rest}")
        count = self.value(match[3], match[4]) if match[4].startswith("%") else int(match[4])
        return self.values[match[2]].moved(count, self._size(match[1]))

    def _size(self, kind: str) -> int:
        return _laid_out(self.run.module, kind)[0]

    def op_load(self, rest):
        match = re.match(rf"(\w+), ptr {_VALUE}", rest)
        return self.memory.load(self.values[match[2]], match[1])

    def op_store(self, rest):
        match = re.match(rf"(\w+) {_VALUE}, ptr {_VALUE}", rest)
        self.memory.store(self.value(match[1], match[2]), self.values[match[3]], SIZES[match[1]])

    def op_alloca(self, rest):
        struct = Struct(f"stack{len(self.structs)}", {}, {}, on_stack=True)
        self.structs.append(struct)
        return Pointer(struct)

    # Calls.

    def op_call(self, rest):
        match = re.match(r'(\S+) @("[^"]*"|[\w.$]+)\((.*)\)', rest)
        if not match or _FAST.search(rest.split("@")[0]):
            self.refuse(f"a call that is not understood: {rest}")
        _result, name, text = match[1], match[2].strip('"'), match[3]
        if name.startswith("llvm.lifetime."):
            return None
        if name.startswith("llvm.memset.") and ", i8 0," not in text:
            self.refuse(f"memory that is not set to zero: {rest}")
        arguments = [self.typed(re.sub(r"\w+\([^()]*\) ?", "", part)) for part in _split(text)]
        if re.match(r"llvm\.(fabs|sqrt)\.|sqrtf$|_ZN4libm4math4sqrt4sqrt17h", name):
            return abs(arguments[0]) if "fabs" in name else self.run.compute("sqrt", arguments[0])
        if name.startswith(("llvm.memcpy.", "llvm.memset.")):
            size = int(_split(text)[2].split()[-1])
            return (
                self.memory.copy(*arguments[:2], size)
                if "memcpy" in name
                else self.memory.clear(arguments[0], size)
            )
        if name.startswith("llvm.fptosi.sat.i32."):
            # Or any number, if only the loads are checked.
            return Word.any("cell", 4) if "fptosi" in self.run.havoc else arguments[0].saturated()
        if name.startswith(("llvm.uadd.sat.", "llvm.usub.sat.", "llvm.umin.", "llvm.umax.")):
            a, b = arguments
            full = Word.of(-1, a.size)
            return {
                "uadd": lambda: (a + b < a).pick(full, a + b), "usub": lambda: (a < b).pick(Word.of(0, a.size), a - b),
                "umin": lambda: (a < b).pick(a, b), "umax": lambda: (a > b).pick(a, b),
            }[name[5:9]]()  # fmt: skip
        return self.run.call(self.run.module.function(name), arguments, self.here, self.structs)


def _laid_out(module: Module, kind: str) -> tuple[int, int]:
    """Size and alignment of a type (bytes)."""
    if kind in SIZES:
        return SIZES[kind], SIZES[kind]
    if array := re.fullmatch(r"\[(\d+) x (.*)\]", kind):
        size, alignment = _laid_out(module, array[2])
        return int(array[1]) * size, alignment
    match = re.fullmatch(r"\{ (.*) \}", module.structs.get(kind, ""))
    if not match:
        raise Refused(f"a type of unknown size: {kind}")
    end, most = 0, 1
    for part in re.findall(r'\[\d+ x (?:%"[^"]*"|\w+)\]|%"[^"]*"|\w+', match[1]):
        size, alignment = _laid_out(module, part)
        end, most = -(-end // alignment) * alignment + size, max(most, alignment)
    return -(-end // most) * most, most


def _split(text: str) -> list[str]:
    """Arguments, split at the commas."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]
