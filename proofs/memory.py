"""Memory of the symbolic execution: structs of scalars, and the stack byte by byte.

A pointer is a struct and an offset in it (bytes). A load or store must meet a scalar of its own size there. This is an
obligation of every lemma, in addition to its claims.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Never

from ir import Leaf
from terms import Bool, Float, Word, any_of

SIZES = {"float": 4, "double": 8, "i8": 1, "i16": 2, "i32": 4, "i64": 8, "ptr": 4}


@dataclass
class Struct:
    """A struct in memory: a value for each scalar in it, on the stack a value for each stored byte."""

    name: str
    leaves: dict[int, Leaf]
    cells: dict[int, Float | Word]
    on_stack: bool = False

    def copy(self) -> dict[int, Float | Word]:
        return dict(self.cells)


#: The target of a null pointer, which no load or store may reach.
NULL = Struct("null", {}, {})


@dataclass
class Pointer:
    struct: Struct
    #: A number if it is known.
    offset: int | Word = 0

    def word(self) -> Word:
        return Word.of(self.offset, 4) if isinstance(self.offset, int) else self.offset

    def moved(self, count: int | Word, size: int) -> Pointer:
        if isinstance(count, int) and isinstance(self.offset, int):
            return Pointer(self.struct, self.offset + count * size)
        steps = Word.of(count * size, 4) if isinstance(count, int) else count.resized(4) * size
        return Pointer(self.struct, self.word() + steps)

    def chosen(self, condition: Bool, no: Pointer | Either) -> Pointer | Either:
        if isinstance(no, Either) or self.struct is not no.struct:
            return Either(condition, self, no)
        if isinstance(self.offset, int) and isinstance(no.offset, int):
            return self if self.offset == no.offset else Either(condition, self, no)
        return Pointer(self.struct, condition.pick(self.word(), no.word()))


@dataclass
class Either:
    """A pointer to one of two places."""

    condition: Bool
    yes: Pointer | Either
    no: Pointer | Either

    def chosen(self, condition: Bool, no: Pointer | Either) -> Either:
        return Either(condition, self, no)

    def moved(self, count: int | Word, size: int) -> Either:
        return Either(self.condition, self.yes.moved(count, size), self.no.moved(count, size))


@dataclass
class Access:
    """Loads and stores of a block that is reached where `here` holds."""

    obligations: list[Bool]
    assume: Callable[[Bool], None]
    here: Bool
    refuse: Callable[[str], Never]

    def _places(self, pointer: Pointer, size: int) -> list[tuple[int, Bool]]:
        """Its possible targets, each a scalar of this size: an obligation."""
        at = pointer.offset
        if isinstance(at, int):
            if at not in pointer.struct.leaves or pointer.struct.leaves[at].size != size:
                self.refuse(f"{pointer.struct.name} holds no scalar of {size} bytes at {at}")
            return [(at, Bool(True))]
        leaves = (leaf for leaf in pointer.struct.leaves.values() if leaf.size == size)
        places = [(leaf.offset, at.same(leaf.offset)) for leaf in leaves]
        self.obligations.append(self.here.implies(any_of(condition for _, condition in places)))
        return places

    def _not_null(self, pointer: Pointer | Either) -> Pointer | Either:
        """The pointer without null as one of its targets: an obligation."""
        if isinstance(pointer, Either):
            for null, other, chosen in (
                (pointer.yes, pointer.no, pointer.condition),
                (pointer.no, pointer.yes, ~pointer.condition),
            ):
                if isinstance(null, Pointer) and null.struct is NULL:
                    self.obligations.append(~(self.here & chosen))
                    return self._not_null(other)
        return pointer

    def _both(self, pointer: Either) -> list[tuple[Access, Pointer | Either, Bool]]:
        """An access to each of the places, the place, and where it is the chosen one."""
        places = ((pointer.yes, pointer.condition), (pointer.no, ~pointer.condition))
        return [(replace(self, here=self.here & chosen), place, chosen) for place, chosen in places]

    def load(self, pointer: Pointer | Either, kind: str):
        pointer = self._not_null(pointer)
        if isinstance(pointer, Either):
            yes, no = (access.load(place, kind) for access, place, _ in self._both(pointer))
            return pointer.condition.pick(yes, no)
        if pointer.struct.on_stack:
            word = Word.joined([self._byte(pointer, n) for n in range(SIZES[kind])])
            return word.float() if kind in ("float", "double") else word
        if parts := self._several(pointer, SIZES[kind]):
            words = [self.load(part, f"i{8 * size}") for part, size in parts]
            return Word.joined(words).float() if kind in ("float", "double") else Word.joined(words)
        result = None
        for at, condition in self._places(pointer, SIZES[kind]):
            value = pointer.struct.cells[at]
            if kind not in ("float", "double"):
                value = value.bits(self.assume) if isinstance(value, Float) else value
            elif isinstance(value, Word):
                value = value.float()
            result = value if result is None else value.chosen(condition, result)
        return result

    def _several(self, pointer: Pointer, size: int) -> list[tuple[Pointer, int]]:
        """The smaller scalars that one access covers, if it does and leaves no gap."""
        start, parts = pointer.offset, []
        if (
            not isinstance(start, int)
            or start not in pointer.struct.leaves
            or pointer.struct.leaves[start].size >= size
        ):
            return []
        while start < pointer.offset + size:
            leaf = pointer.struct.leaves.get(start)
            if leaf is None or start + leaf.size > pointer.offset + size:
                return []
            parts.append((Pointer(pointer.struct, start), leaf.size))
            start += leaf.size
        return parts

    def _byte(self, pointer: Pointer, n: int) -> Word:
        if not isinstance(pointer.offset, int):
            self.refuse("a place on the stack that is not known")
        return pointer.struct.cells.setdefault(pointer.offset + n, Word.any("unset", 1))

    def store(self, value: Float | Word, pointer: Pointer | Either, size: int) -> None:
        pointer = self._not_null(pointer)
        if isinstance(pointer, Either):
            kind = f"i{8 * size}" if isinstance(value, Word) else {4: "float", 8: "double"}[size]
            for access, place, chosen in self._both(pointer):
                access.store(value.chosen(chosen, access.load(place, kind)), place, size)
            return
        word = value.bits(self.assume) if isinstance(value, Float) and pointer.struct.on_stack else value
        if pointer.struct.on_stack:
            for n in range(size):
                self._byte(pointer, n)
                pointer.struct.cells[pointer.offset + n] = word.bytes(n, 1)
            return
        if parts := self._several(pointer, size):
            word = value.bits(self.assume) if isinstance(value, Float) else value
            for part, length in parts:
                self.store(word.bytes(part.offset - pointer.offset, length), part, length)
            return
        for at, condition in self._places(pointer, size):
            old, new = pointer.struct.cells[at], value
            # A place holds either floats or words during the whole execution.
            if isinstance(old, Float) != isinstance(value, Float):
                new = value.float() if isinstance(value, Word) else value.bits(self.assume)
            pointer.struct.cells[at] = new if isinstance(pointer.offset, int) else new.chosen(condition, old)

    def copy(self, to: Pointer | Either, source: Pointer | Either, size: int) -> None:
        """Scalar by scalar, with the names of the side that has them."""
        one_to, one_source = (p.yes if isinstance(p, Either) else p for p in (to, source))
        known = one_source if one_to.struct.on_stack or not isinstance(one_to.offset, int) else one_to
        leaves = (
            [Leaf("", n, 1, "int") for n in range(size)]
            if known.struct.on_stack
            else known.struct.leaves.values()
        )
        start = 0 if known.struct.on_stack else known.offset
        for leaf in leaves:
            if start <= leaf.offset < start + size:
                step = leaf.offset - start
                kind = {1: "i8", 2: "i16", 4: "i32", 8: "i64"}[leaf.size]
                self.store(self.load(source.moved(step, 1), kind), to.moved(step, 1), leaf.size)

    def clear(self, to: Pointer, size: int) -> None:
        if to.struct.on_stack:
            for n in range(size):
                self.store(Word.of(0, 1), to.moved(n, 1), 1)
            return
        for leaf in to.struct.leaves.values():
            if to.offset <= leaf.offset < to.offset + size:
                self.store(Word.of(0, leaf.size), Pointer(to.struct, leaf.offset), leaf.size)
