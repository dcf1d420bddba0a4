"""A lemma: a function of the core, its assumptions, its claims, and its broken twin, which must be refuted."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from bitwuzla import Bitwuzla, Result
from cut import Cut, nearest
from execute import Run
from ir import Leaf, Module, Refused
from memory import SIZES, Pointer, Struct
from refine import Abstraction, Limit, Operation, Search, solver_within
from terms import Bool, Float, Word, all_of

Formulas = dict[str, Bool]


@dataclass(frozen=True)
class Twin:
    """The difference of the twin: one assumption is missing, or the first match of a pattern in the instructions changes."""

    without: str | None = None
    swap: tuple[str, str] | None = None


@dataclass(frozen=True)
class Lemma:
    name: str
    #: Its name in the IR, without the precision.
    function: str
    given: Callable[[Case], Formulas]
    shows: Callable[[Case], Formulas]
    twin: Twin
    precisions: tuple[str, ...] = ("f32", "f64")
    #: Operations that are replaced by the rules.
    havoc: frozenset[str] = frozenset()
    rules: tuple = ()
    #: Whether all operations begin as unknowns and are refined: see `refine.py`.
    refined: bool = False
    #: The values of a cut, and what another lemma shows of them: see `cut.py`.
    cut: Callable[[Case], tuple[list[Float], Formulas]] | None = None
    #: Included in a fast run.
    fast: bool = True
    #: Whether the solver may run out of time: counted as open, not as proven.
    hard: bool = False


class View:
    """The scalars of a struct by the names of its fields: `view.lead.pole`, `view.rows[3].start`."""

    def __init__(self, layout: list[Leaf], cells: dict, path: str = ""):
        self._layout, self._cells, self._path = layout, cells, path
        self._places = {leaf.path: leaf.offset for leaf in layout}

    def _at(self, path: str):
        if path in self._places:
            return self._cells[self._places[path]]
        if not any(known.startswith(path + ".") for known in self._places):
            near = [known for known in self._places if known.startswith(path.rpartition(".")[0])]
            raise Refused(f"no field {path}: there are {', '.join(near[:20])}")
        return View(self._layout, self._cells, path)

    def __getattr__(self, name: str):
        return self._at(f"{self._path}.{name}" if self._path else name)

    def __getitem__(self, index: int):
        return self._at(f"{self._path}.{index}")

    def all(self) -> dict[str, Float | Word]:
        inside = (self._path, self._path + ".")
        return {
            path: self._cells[at]
            for path, at in self._places.items()
            if not self._path or path == inside[0] or path.startswith(inside[1])
        }


@dataclass
class Case:
    """The values that a lemma refers to: the arguments before and, as `after`, after the call, and the result."""

    size: int
    arguments: dict
    run: Run
    after: dict = field(default_factory=dict)
    result: object = None
    cut: Cut | None = None
    #: Claims on the way to those of the lemma. One that is not proven counts for nothing.
    steps: Formulas = field(default_factory=dict)

    def scalars(self):
        """Those of the arguments, and what stands in the place of the values of a cut."""
        yield from self.cut.unknowns if self.cut else []
        for value in self.arguments.values():
            for scalar in value.all().values() if isinstance(value, View) else [value]:
                yield scalar._bits if isinstance(scalar, Float) else scalar

    def made(self, value: Float) -> Operation:
        """The operation whose result is a value, perhaps one of several values."""
        found = nearest(self.run.abstraction, [value.term])
        if len(found) != 1:
            raise Refused(f"a value from {len(found)} operations, not from one")
        return found[0]

    def __getattr__(self, name: str):
        try:
            return self.arguments[name]
        except KeyError:
            raise AttributeError(f"no argument {name}: there are {', '.join(self.arguments)}") from None


@dataclass
class Outcome:
    verdict: str  # "proven", "refuted", "out of time" or "refused"
    seconds: float
    text: str = ""


def _struct(name: str, layout: list[Leaf]) -> Struct:
    # Variants overlap in memory; the tag has priority over the field at its offset.
    leaves: dict[int, Leaf] = {}
    for leaf in layout:
        if leaves.setdefault(leaf.offset, leaf).size != leaf.size:
            raise Refused(f"{name}: two scalars of different sizes at {leaf.offset}")
    places = sorted(leaves.values(), key=lambda leaf: leaf.offset)
    if any(a.offset + a.size > b.offset for a, b in itertools.pairwise(places)):
        raise Refused(f"{name}: scalars that overlap")
    cells: dict[int, Float | Word] = {}
    for leaf in places:
        word = Word.any(f"{name}.{leaf.path}", leaf.size)
        cells[leaf.offset] = word.float() if leaf.kind == "float" else word
    return Struct(name, leaves, cells)


def _broken(module: Module, lemma: Lemma, name: str, swap: tuple[str, str], seen: set[str]) -> bool:
    """Changes the first matching instruction of the function or of the functions that it calls."""
    seen.add(name)
    called = []
    for block in module.function(name).blocks.values():
        for n, instruction in enumerate(block):
            text = f"{instruction.op} {instruction.rest}"
            changed = re.sub(swap[0], swap[1], text, count=1)
            if changed != text:
                op, _, rest = changed.partition(" ")
                block[n] = replace(instruction, op=op, rest=rest)
                return True
            called += re.findall(r'@"?(_ZN[^"(]*)"?\(', text) if instruction.op == "call" else []
    known = [other for other in called if other in module.names() and other not in seen]
    return any(_broken(module, lemma, other, swap, seen) for other in known)


def _formulas(module: Module, lemma: Lemma, precision: str, twin: Twin | None):
    """The assumptions and the claims."""
    name = f"{lemma.function}_{precision}"
    if twin and twin.swap and not _broken(module, lemma, name, twin.swap, set()):
        raise Refused(f"{lemma.name}: no instruction fits {twin.swap[0]}")
    function = module.function(name)
    run = Run(module, lemma.havoc, lemma.rules, abstraction=Abstraction() if lemma.refined else None)
    structs, values, before, layouts = [], [], {}, {}
    for (argument, kind), layout in zip(function.arguments, module.layouts(function)):
        argument = argument.strip("%")
        if layout is not None:
            struct = _struct(argument, layout)
            structs.append(struct)
            values.append(Pointer(struct))
            before[argument] = View(layout, struct.copy())
            layouts[argument] = layout
            for leaf in struct.leaves.values():
                if leaf.kind == "bool":
                    run.assume(struct.cells[leaf.offset] <= 1)
            if layout and layout[0].path == "":
                before[argument] = struct.cells[layout[0].offset]
        else:
            value = Word.any(argument, SIZES[kind]) if kind != "i1" else Word.any(argument, 1).bit()
            values.append(value.float() if kind in ("float", "double") else value)
            before[argument] = values[-1]
    result = run.call(function, values, Bool(True), structs)
    case = Case(4 if precision == "f32" else 8, before, run)
    given = lemma.given(case)
    case.after = {
        s.name: View(layouts[s.name], s.cells) if layouts[s.name][0].path else s.cells[0]
        for s in structs
        if not s.on_stack
    }
    case.result = result
    claims = lemma.shows(case)
    cut_at, shown = lemma.cut(case) if lemma.cut else ([], {})
    given |= shown
    if twin and twin.without:
        del given[twin.without]
    if lemma.cut:
        case.cut = Cut(run.abstraction, cut_at)
        premises, after = case.cut.through(list(given.values()), run.assumptions, {**case.steps, **claims})
        case.steps, claims = ({name: after[name] for name in part} for part in (case.steps, claims))
        run.abstraction = case.cut.abstraction
        return premises, claims, case
    claims["every load and store meets a scalar of its size"] = all_of(run.obligations)
    return [*given.values(), *run.assumptions], claims, case


def check(texts: list[str], lemma: Lemma, precision: str, broken: bool, seconds: int) -> Outcome:
    """Proves a lemma or refutes it."""
    start = time.process_time()
    try:
        module = Module(*texts)
        premises, claims, case = _formulas(module, lemma, precision, lemma.twin if broken else None)
    except Refused as refusal:
        return Outcome("refused", time.process_time() - start, str(refusal))
    outcome = solved([premise.term for premise in premises], claims, seconds, case)
    return replace(outcome, seconds=time.process_time() - start)


def solved(premises: list, claims: Formulas, seconds: int, case: Case | None = None) -> Outcome:
    """Each claim on its own; the first that fails refutes."""
    start, slow, proven = time.process_time(), [], []
    steps = case.steps if case else {}
    for name, claim in [*steps.items(), *claims.items()]:
        if case and case.run.abstraction:
            inputs = [scalar.term for scalar in case.scalars()]
            search = Search(case.run.abstraction, premises, proven, claim, inputs, seconds)
            result, solver = search.run()
        else:
            result, solver = _searched(premises, claim, seconds)
        if result == Result.UNSAT:
            proven.append(claim.term)
        elif name in steps:
            continue
        elif result == Result.SAT:
            at = f" at {_model(solver, case)}" if case else ""
            return Outcome("refuted", time.process_time() - start, f"{name}: not{at}")
        else:
            slow.append(name)
    return Outcome("out of time" if slow else "proven", time.process_time() - start, "; ".join(slow))


def _searched(premises: list, claim: Bool, seconds: int) -> tuple[Result, Bitwuzla]:
    solver = solver_within(Limit(seconds))
    for premise in premises:
        solver.assert_formula(premise)
    solver.assert_formula((~claim).term)
    return solver.check_sat(), solver


def _model(solver: Bitwuzla, case: Case) -> str:
    shown = []
    for name, value in case.arguments.items():
        scalars = value.all() if isinstance(value, View) else {"": value}
        for path, scalar in list(scalars.items())[:400]:
            label = f"{name}.{path}" if path else name
            shown.append(f"{label} = {_number(solver, scalar)}")
    return ", ".join(shown)


def _number(solver: Bitwuzla, scalar) -> str:
    if isinstance(scalar, Float):
        import struct

        word = scalar._bits
        if word is None:
            return "?"
        bits = int(str(solver.get_value(word.term)).removeprefix("#b"), 2)
        code, whole = ("<f", "<I") if scalar.size == 4 else ("<d", "<Q")
        return repr(struct.unpack(code, struct.pack(whole, bits))[0])
    text = str(solver.get_value(scalar.term))
    return str(int(text[2:], 2)) if text.startswith("#b") else text
