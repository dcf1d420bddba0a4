"""Writes the C reference from the header itself: constants, structs and functions by section."""

import re
from pathlib import Path

from eft._files import write_text

HEADER = Path(__file__).parents[2] / "crates" / "eft-ffi" / "include" / "eft.h"
SECTION = re.compile(r"^/\* -{5,} (.+?) -{5,} \*/$", re.MULTILINE)
CONSTANT = re.compile(r"^#define (EFT_\w+) (\(.*?\)|\S+)\s*(?://\s*(.*))?$")
MEMBER = re.compile(r"^\s+(.+?);\s*(?://\s*(.*))?$")
# The double-precision half repeats the names with another suffix, and the last section is a list of sizes.
LEFT_OUT = ("Double precision", "Sizes")


def write(folder: Path) -> None:
    """Write the page's generated part, and the rules from the overview at the top of the header."""
    text = HEADER.read_text(encoding="utf-8")
    overview = text[text.index("/*") + 2 : text.index("*/")]
    rules = overview[overview.index("Rules for every function:") :]
    parts = SECTION.split(text)
    sections = [
        f"## {title}\n\n{_section(body)}"
        for title, body in zip(parts[1::2], parts[2::2], strict=True)
        if not title.startswith(LEFT_OUT)
    ]
    write_text(folder / "c-rules.md", _rules(rules))
    write_text(folder / "c.md", "\n".join(sections))


def _rules(text: str) -> str:
    """The list of rules for all functions, without the header's indent."""
    lines = [line.strip() for line in text.splitlines()[1:]]
    return "\n".join(line if line.startswith("- ") else f"  {line}" for line in lines if line) + "\n"


def _section(text: str) -> str:
    """One section: a comment belongs to the next item and to structs after it without one."""
    shown, comment, shared, lines = [], [], [], iter(text.splitlines())
    for line in lines:
        if line.startswith("//"):
            comment.append(line[2:].strip())
            continue
        if constant := CONSTANT.match(line):
            name, value, meaning = constant.groups()
            shown.append(_directive("c:macro", f"{name}", [f"`{value}`: {meaning or ''}".rstrip(": ")]))
        elif line.startswith("typedef struct"):
            shared = comment or shared
            shown.append(_struct(line, lines, shared))
        elif line.startswith("EFT_NODISCARD"):
            while not line.rstrip().endswith(";"):
                line += " " + next(lines).strip()
            signature = line.removeprefix("EFT_NODISCARD").strip().rstrip(";")
            shown.append(_directive("c:function", signature, [" ".join(comment)]))
        elif line.strip():
            continue
        comment = []
    return "\n".join(shown)


def _struct(first: str, lines: object, comment: list[str]) -> str:
    name = first.split()[2]
    if "marker;" in first:
        about = [" ".join(comment), "Opaque: made and read by functions only."]
        return _directive("c:struct", name, about)
    if first.rstrip().endswith(";"):
        return _directive("c:struct", name, [" ".join(comment)])
    members = []
    for line in lines:
        if line.startswith("}"):
            break
        if member := MEMBER.match(line):
            members.append(_directive("c:member", member[1], [member[2] or ""], fence=":::"))
        elif line.strip().startswith("//"):
            members[-1] = members[-1].replace("\n:::", f" {line.strip()[2:].strip()}\n:::")
    return _directive("c:struct", name, [" ".join(comment), *members], fence="::::")


def _directive(kind: str, argument: str, body: list[str], fence: str = ":::") -> str:
    text = "\n\n".join(part for part in body if part)
    return f"{fence}{{{kind}}} {argument}\n{text}\n{fence}\n"
