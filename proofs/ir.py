"""Reads the LLVM IR that rustc writes: functions as blocks of instructions, and what the debug information says of the
fields of a struct."""

from __future__ import annotations

import re
from dataclasses import dataclass, field


class Refused(Exception):
    """The IR contains something that the reader does not support."""


@dataclass
class Instruction:
    """`dest = op rest`, without hints for the optimizer."""

    dest: str | None
    op: str
    rest: str


@dataclass
class Function:
    name: str
    result: str
    arguments: list[tuple[str, str]]
    debug: str
    blocks: dict[str, list[Instruction]] = field(default_factory=dict)


@dataclass(frozen=True)
class Leaf:
    """A scalar of a struct: its offset (bytes), size (bytes) and kind."""

    path: str
    offset: int
    size: int
    kind: str  # "float", "bool", "int" or "tag"


_NAME = r'[%@](?:"[^"]*"|[-\w.$]+)'
_NOISE = re.compile(r", (?:align \d+|![\w.]+ !\d+|!\w+ !\{[^}]*\})")
_ATTRIBUTES = re.compile(
    r"\b(?:tail|musttail|noundef|nonnull|noalias|readonly|writeonly|zeroext|signext|dso_local|unnamed_addr|range\([^)]*\)|"
    r"captures\([^)]*\)|dereferenceable\(\d+\)|initializes\(\([^)]*\)\)|align \d+|inreg|internal|fastcc)\s+"
)


def _cleaned(line: str) -> str:
    line = _NOISE.sub("", line)
    return _ATTRIBUTES.sub("", line).strip()


class Module:
    """`.ll` files: the functions of all of them, and the debug information of the first."""

    def __init__(self, *texts: str):
        self.structs: dict[str, str] = {}
        self._metadata: dict[str, str] = {}
        self._unread: dict[str, list[str]] = {}
        self._functions: dict[str, Function] = {}
        for n, text in enumerate(texts):
            self._read(text.splitlines(), with_metadata=n == 0)

    def _read(self, lines: list[str], with_metadata: bool) -> None:
        start = 0
        for n, line in enumerate(lines):
            if line.startswith("define "):
                start = n
            elif line == "}":
                name = re.search(r'@("[^"]*"|[\w.$]+)\(', lines[start])[1].strip('"')
                self._unread.setdefault(name, lines[start : n + 1])
            elif line.startswith("%") and (match := re.match(r"(%(?:\"[^\"]*\"|[\w.]+)) = type (.*)", line)):
                self.structs[match[1]] = match[2]
            elif with_metadata and (match := re.match(r"(!\d+) = (?:distinct )?(.*)", line)):
                self._metadata[match[1]] = match[2]

    def names(self) -> list[str]:
        return list(self._unread)

    def function(self, name: str) -> Function:
        if name not in self._functions:
            if name not in self._unread:
                raise Refused(f"{name}: its instructions are not here")
            lines = iter(self._unread[name])
            function = self._signature(next(lines))
            self._body(function, lines)
            self._functions[name] = function
        return self._functions[name]

    def _signature(self, line: str) -> Function:
        head = re.match(rf"define (.*?)({_NAME})\((.*?)\) *unnamed_addr.*?!dbg (!\d+)", line)
        if not head:
            raise Refused(f"a signature that is not understood: {line[:120]}")
        arguments = []
        inner = re.sub(r"\w+\([^()]*(?:\([^()]*\)[^()]*)*\)", "", head[3])  # attributes with brackets
        for argument in filter(None, (part.strip() for part in inner.split(","))):
            words = argument.split()
            arguments.append((words[-1], words[0]))
        result = re.sub(r"range\([^)]*\)", "", head[1]).split()[-1]
        return Function(head[2].strip('@"'), result, arguments, head[4])

    def _body(self, function: Function, lines) -> None:
        block: list[Instruction] = []
        for line in lines:
            if line == "}":
                return
            text = line.split(" ; ")[0] if not line.startswith(" ") else line
            if label := re.match(r'("[^"]*"|[-\w.$]+):', text):
                block = function.blocks[label[1].strip('"')] = []
                continue
            text = line.strip()
            if not text or text.startswith((";", "#dbg")) or "@llvm.experimental.noalias.scope.decl" in text:
                continue
            while text.startswith("switch") and "]" not in text:
                text += " " + next(lines).strip()
            text = _cleaned(text)
            match = re.match(rf"(?:({_NAME}) = )?(\w+)\s*(.*)", text)
            if not match:
                raise Refused(f"{function.name}: a line that is not understood: {text}")
            block.append(Instruction(match[1], match[2], match[3]))
        raise Refused(f"{function.name} does not end")

    # Debug information.

    def _field(self, node: str, name: str) -> str | None:
        match = re.search(rf'\b{name}: (?:"([^"]*)"|([^,)]+))', self._metadata[node])
        return match and (match[1] if match[1] is not None else match[2])

    def _list(self, node: str | None) -> list[str]:
        return re.findall(r"!\d+|null", self._metadata[node]) if node and node in self._metadata else []

    def layouts(self, function: Function) -> list[list[Leaf] | None]:
        """For each argument that is a pointer, the scalars behind it."""
        kinds = self._list(self._field(self._field(function.debug, "type"), "types"))[1:]
        if len(kinds) != len(function.arguments):
            raise Refused(f"{function.name}: its arguments are not those of the source")
        layouts: list[list[Leaf] | None] = []
        for kind, (_, llvm) in zip(kinds, function.arguments):
            layouts.append(
                list(self._leaves(self._field(kind, "baseType"), "", 0)) if llvm == "ptr" else None
            )
        return layouts

    def _leaves(self, node: str, path: str, offset: int):
        text = self._metadata[node]
        size = int(self._field(node, "size") or 0) // 8
        if text.startswith("!DIBasicType"):
            if size:
                encoding = self._field(node, "encoding")
                kind = {"DW_ATE_float": "float", "DW_ATE_boolean": "bool"}.get(encoding, "int")
                yield Leaf(path, offset, size, kind)
        elif "DW_TAG_enumeration_type" in text:
            yield Leaf(path, offset, size, "tag")
        elif "DW_TAG_array_type" in text:
            (bounds,) = self._list(self._field(node, "elements"))
            count = int(self._field(bounds, "count"))
            element = self._field(node, "baseType")
            for n in range(count):
                yield from self._leaves(element, f"{path}.{n}", offset + n * (size // count))
        elif "DW_TAG_structure_type" in text:
            for member in self._list(self._field(node, "elements")):
                yield from self._member(member, path, offset)
        else:
            raise Refused(f"{path}: a kind of type that is not understood: {text[:60]}")

    def _member(self, member: str, path: str, offset: int):
        text = self._metadata[member]
        inner = lambda name: f"{path}.{name}" if path else name  # noqa: E731
        if "DW_TAG_member" in text:
            at = offset + int(self._field(member, "offset") or 0) // 8
            yield from self._leaves(self._field(member, "baseType"), inner(self._field(member, "name")), at)
        elif "DW_TAG_variant_part" in text:
            # The discriminant. The fields of a variant are found by their offset.
            tag = self._field(member, "discriminator")
            if tag:
                at = offset + int(self._field(tag, "offset") or 0) // 8
                size = int(self._field(tag, "size")) // 8
                yield Leaf(inner("variant"), at, size, "tag")
            for variant in self._list(self._field(member, "elements")):
                name = self._field(variant, "name")
                at = offset + int(self._field(variant, "offset") or 0) // 8
                yield from self._leaves(self._field(variant, "baseType"), inner(name), at)
        elif "DW_TAG_structure_type" not in text:
            raise Refused(f"{path}: a member that is not understood: {text[:60]}")
