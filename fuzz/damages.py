"""Random damage of bytes, of texts and of values of JSON, and of the members of an archive of arrays."""

from __future__ import annotations

import io
import json
import re
import zipfile
from random import Random
from typing import Any

import numpy as np

NUMBERS = (0, -1, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63)
TEXTS = ("", "\0", "é" * 50, "<b>", "nan", "inf", "-0", "1e999", "9" * 400, "[" * 300, "a." * 300 + "a", "\n")
VALUES = (
    None,
    True,
    -1,
    0,
    10**30,
    1e308,
    float("nan"),
    float("-inf"),
    "",
    "x" * 300,
    [],
    {},
    [[1.0]],
    {"a": 1},
)
TYPES = ("<f4", ">f8", "<i8", "<u4", "<c16", "<U8", "<M8[s]", "?")


def of_bytes(data: bytes, chance: Random) -> bytes:
    """One to four changes: a byte, a number, a piece that is removed, doubled or inserted, or the end."""
    changed = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        # Headers and directories are near the ends.
        reach = len(changed) if chance.random() < 0.5 else min(len(changed), 600)
        at = chance.randrange(reach + 1)
        at = at if chance.random() < 0.5 else len(changed) - at
        piece = slice(at, at + chance.choice((1, 4, 8, 64, 1000)))
        match chance.randrange(7):
            case 0:
                changed[at : at + 1] = bytes([chance.randrange(256)])
            case 1:
                changed[at : at + 1] = bytes(byte ^ 1 << chance.randrange(8) for byte in changed[at : at + 1])
            case 2:
                size = chance.choice((2, 4, 8))
                changed[at : at + size] = (chance.choice(NUMBERS) % 256**size).to_bytes(size, "little")
            case 3:
                del changed[piece]
            case 4:
                changed[at:at] = changed[piece]
            case 5:
                changed[at:at] = chance.randbytes(chance.choice((1, 4, 200)))
            case 6 if chance.random() < 0.3:
                del changed[at:]
    return bytes(changed)


def of_text(text: str, chance: Random) -> str:
    """One to three changes: a number, a word, a line, or some bytes."""
    for _ in range(chance.randint(1, 3)):
        words = list(re.finditer(r"[-+.\w]+", text))
        numbers = list(re.finditer(r"(?<![-+.\w])[-+]?\d[-+.\d_e]*(?![\w.])", text))
        lines = text.splitlines(keepends=True)
        place = chance.randrange(len(lines) + 1)
        match chance.randrange(5):
            case 0 | 1 if numbers:
                number = chance.choice(numbers)
                put = chance.choice((10 ** chance.uniform(-3, 3), -1, 0, *NUMBERS, 1e308, float("nan")))
                text = text[: number.start()] + repr(put) + text[number.end() :]
            case 2 if words:
                word = chance.choice(words)
                put = chance.choice((*TEXTS, *map(repr, VALUES), chance.choice(words)[0]))
                text = text[: word.start()] + put + text[word.end() :]
            case 3 if lines:
                other = chance.choice(lines)
                text = "".join([*lines[:place], *([other] * chance.randint(0, 2)), *lines[place + 1 :]])
            case _:
                text = of_bytes(text.encode(), chance).decode("utf-8", "replace")
    return text


def of_shape(text: str, chance: Random) -> str:
    """TOML with a value or a key of extreme depth or length after one of its lines."""
    size = int(10 ** chance.uniform(1.0, 5.0))
    key = chance.choice(("a", '"a"', "a" + ".a" * size, '"a' + ".a" * size + '"', '"a".' * size + "a"))
    value = chance.choice(("1", "[" * size, "[" + "1," * size + "]", "{a = " * size, "'" + "a" * size + "'"))
    new = chance.choice((f"{key} = {value}\n", f"[{key}]\n", f"[[{key}]]\n", f"{key} = 1\n", "\ufeff"))
    lines = text.splitlines(keepends=True)
    place = chance.randrange(len(lines) + 1)
    return "".join([*lines[:place], new, *lines[place:]])


def of_json(value: Any, chance: Random) -> Any:
    """One value within a value, replaced, removed or doubled."""
    if isinstance(value, dict) and value and chance.random() < 0.9:
        key = chance.choice(list(value))
        match chance.randrange(10):
            case 0:
                return {name: kept for name, kept in value.items() if name != key}
            case 1:
                return value | {chance.choice(TEXTS): value[key]}
        return value | {key: of_json(value[key], chance)}
    if isinstance(value, list) and value and chance.random() < 0.9:
        place = chance.randrange(len(value))
        changed = [] if chance.random() < 0.1 else [of_json(value[place], chance)] * chance.randint(1, 2)
        return [*value[:place], *changed, *value[place + 1 :]]
    return chance.choice((*VALUES, *TEXTS))


def of_json_text(text: str, chance: Random) -> str:
    """A changed value, or a changed text."""
    return json.dumps(of_json(json.loads(text), chance)) if chance.random() < 0.7 else of_text(text, chance)


def of_array(array: np.ndarray, chance: Random) -> np.ndarray:
    """An array of another shape, of another type, or with other values."""
    match chance.randrange(5):
        case 0:
            return array[..., None] if chance.random() < 0.5 else array.reshape(-1)[: chance.randrange(3)]
        case 1:
            return np.zeros(array.shape, chance.choice(TYPES))
        case 2 if array.dtype.kind == "U":
            text = array.item()
            return np.array(of_json_text(text, chance) if text.startswith("{") else of_text(text, chance))
        case 3 if array.dtype.kind in "fiu" and array.size:
            changed = array.copy()
            values = (
                (0, 1, 2**31 - 1) if array.dtype.kind != "f" else (0.0, -1.0, 1e308, 1e-308, np.nan, np.inf)
            )
            changed.flat[:: chance.choice((1, 7, array.size))] = chance.choice(values)
            return changed
        case _:
            return np.array(
                chance.choice([value for value in VALUES if isinstance(value, str | float | bool)])
            )


def of_archive(data: bytes, chance: Random) -> bytes:
    """The archive's bytes, or one member with a checksum that is right again."""
    if chance.random() < 0.3:
        return of_bytes(data, chance)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice(list(members))
    match chance.randrange(8):
        case 0:
            del members[name]
        case 1:
            members[chance.choice(list(members))] = members[name]
        case 2 | 3:
            members[name] = of_bytes(members[name], chance)
        case _:
            changed = io.BytesIO()
            np.save(changed, of_array(np.load(io.BytesIO(members[name])), chance))
            members[name] = changed.getvalue()
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", chance.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return made.getvalue()
