"""The place of a key in a TOML file, for errors about its value."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from pathlib import Path

_PART = r"""[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*'"""
_KEY = rf"(?:{_PART})(?:\s*\.\s*(?:{_PART}))*"
_HEADER = re.compile(rf"\s*\[\[?\s*({_KEY})\s*\]")
_ENTRY = re.compile(rf"(\s*)({_KEY})\s*=")

_MISSING = (re.compile(r"missing key `([\w.]+)`"), re.compile(r"^([\w.]+) (?:is )?missing"))
_NAMED = (
    *_MISSING,
    re.compile(r"`([A-Za-z_][\w.]*)`"),
    re.compile(r"\['([\w.]+)'\]"),
    re.compile(r"^(?:[a-z]+: )?([A-Za-z_][\w.]*)"),
)
"""Patterns of key names in messages, the most specific first."""


def pointed(path: Path, text: str, error: ValueError) -> ValueError:
    """The error with the file, and with line and column of the named key if there is one."""
    message = str(error)
    for pattern in _NAMED:
        for key in pattern.findall(message):
            # The value may be in an inline table, whose key is then the nearest.
            above = key.rpartition(".")[0]
            found = place(text, key, header_too=pattern in _MISSING) or ("." in above and place(text, above))
            if found:
                return ValueError(f"{path}, line {found[0]}, column {found[1]}: {message}")
    return ValueError(f"{path}: {message}")


def place(text: str, key: str, *, header_too: bool = False) -> tuple[int, int] | None:
    """Line and column of a dotted key, possibly below another section; optionally those of its section."""
    section, answer = "", None
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            section = _plain(header[1])
            if header_too and section == key.rpartition(".")[0]:
                answer = answer or (number, line.index("[") + 1)
        elif entry := _ENTRY.match(line):
            whole = f"{section}.{_plain(entry[2])}" if section else _plain(entry[2])
            if whole == key or whole.endswith(f".{key}"):
                return number, len(entry[1]) + 1
    return answer


def without_sections(text: str, names: Collection[str]) -> str:
    """The text with some sections blanked and the same lines."""
    return _blanked(text, lambda section: section in names)


def only_sections(text: str, names: Collection[str]) -> str:
    """The text with all other sections blanked and the same lines."""
    return _blanked(text, lambda section: section not in names)


def _blanked(text: str, unwanted: Callable[[str], bool]) -> str:
    kept, inside = [], unwanted("")
    for line in text.splitlines():
        if header := _HEADER.match(line):
            inside = unwanted(_plain(header[1]).partition(".")[0])
        kept.append("" if inside else line)
    return "\n".join(kept)


def _plain(key: str) -> str:
    return ".".join(part.strip("\"'") for part in re.findall(_PART, key))
