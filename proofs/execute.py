"""Symbolic execution of a function of the IR: all paths together, merged where they meet."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from frame import Frame
from ir import Function, Module, Refused
from memory import Struct
from refine import EXACT, Abstraction
from terms import Bool, Float, Word, any_of, applied


@dataclass
class Run:
    """The known facts during and after the execution of a function."""

    module: Module
    #: Operations that are replaced by the `rules`; with a constant they are exact.
    havoc: frozenset[str] = frozenset()
    rules: tuple = ()
    assumptions: list[Bool] = field(default_factory=list)
    obligations: list[Bool] = field(default_factory=list)
    #: In its place: unknowns, which the proof refines.
    abstraction: Abstraction | None = None
    #: Every operation on floats: its name, operands and result.
    done: list[tuple] = field(default_factory=list)

    def compute(self, op: str, *operands: Float) -> Float:
        """A result, or its replacement."""
        if self.abstraction is not None:
            result = self.abstraction.result(op, operands)
        elif op in self.havoc and not any(operand.is_known() for operand in operands):
            result = applied(op, *operands)
            for rule in self.rules:
                for said in rule(op, operands, result, self.done):
                    self.assume(said)
        else:
            result = EXACT[op](*operands)
        self.done.append((op, operands, result))
        return result

    def assume(self, formula: Bool) -> None:
        self.assumptions.append(formula)

    def call(self, function: Function, arguments: list, reached: Bool, structs: list[Struct]):
        """The result; the structs hold the stored values."""
        values = {name: value for (name, _), value in zip(function.arguments, arguments)}
        incoming: dict[str, list[tuple[str, Bool, list[dict]]]] = {label: [] for label in function.blocks}
        entry = next(iter(function.blocks))
        incoming[entry].append(("", reached, [s.copy() for s in structs]))
        returned: list[tuple[Bool, object, list[dict]]] = []
        for label in _in_order(function):
            edges = incoming[label]
            if not edges:
                continue
            here = any_of(condition for _, condition, _ in edges) if len(edges) > 1 else edges[0][1]
            _remember(structs, [(condition, memory) for _, condition, memory in edges])
            frame = Frame(self, function, values, here, structs, edges)
            for instruction in function.blocks[label]:
                if instruction.op in ("br", "switch"):
                    for target, condition in frame.branches(instruction.rest):
                        incoming[target].append((label, here & condition, [s.copy() for s in structs]))
                elif instruction.op == "ret":
                    value = None if instruction.rest == "void" else frame.typed(instruction.rest)
                    returned.append((here, value, [s.copy() for s in structs]))
                elif instruction.op == "unreachable":
                    self.obligations.append(~here)
                else:
                    frame.execute(instruction)
        _remember(structs, [(condition, memory) for condition, _, memory in returned])
        result = returned[0][1]
        for condition, value, _ in returned[1:]:
            result = value.chosen(condition, result) if value is not None else None
        return result


def _in_order(function: Function) -> list[str]:
    """Its blocks, each after its predecessors; a loop is refused."""
    order: list[str] = []
    state: dict[str, int] = {}

    def visit(label: str) -> None:
        if state.get(label) == 1:
            raise Refused(f"{function.name}: a loop that was not unrolled, at {label}")
        if label in state:
            return
        state[label] = 1
        for instruction in function.blocks[label]:
            if instruction.op in ("br", "switch"):
                for target in re.findall(r'label %("[^"]*"|[-\w.$]+)', instruction.rest):
                    visit(target.strip('"'))
        state[label] = 2
        order.append(label)

    visit(next(iter(function.blocks)))
    return order[::-1]


def _remember(structs: list[Struct], parts: list[tuple[Bool, list[dict]]]) -> None:
    """The memory where paths meet."""
    for n, place in enumerate(structs):
        memories = [(condition, memory[n]) for condition, memory in parts if n < len(memory)]
        if not memories:
            continue
        cells = dict(memories[0][1])
        for condition, memory in memories[1:]:
            for offset, value in memory.items():
                old = cells.get(offset, value)
                if isinstance(old, Float) != isinstance(value, Float):
                    old, value = (x.float() if isinstance(x, Word) else x for x in (old, value))
                cells[offset] = value if old is value else value.chosen(condition, old)
        place.cells = cells
