"""Modules of the Rust crates: no folder has files or folders that use each other in a circle."""

import re
from pathlib import Path

import pytest

CRATES = Path(__file__).parents[2] / "crates"
USE = re.compile(r"\b(pub(?:\([\w: ]+\))?\s+)?use\s+([^;]+);")


def branches(tree, before=()):
    """The paths of a `use` tree."""
    head, brace, rest = tree.strip().partition("{")
    before += tuple(name.strip() for name in head.split("::") if name.strip())
    if not brace:
        yield before
    for branch in re.findall(r"(?:[^,{}]|\{(?:[^{}]|\{[^{}]*\})*\})+", rest[: rest.rfind("}")]):
        if branch.strip():
            yield from branches(branch, before)


def modules(source):
    """The text of each module without comments, texts and tests."""
    for file in source.rglob("*.rs"):
        *folder, name = file.relative_to(source).with_suffix("").parts
        if not any(part.endswith("tests") for part in (*folder, name)):
            text = re.sub(r'//.*|"(?:[^"\\]|\\.)*"', "", file.read_text(encoding="utf-8"))
            text = re.sub(r"#\[cfg\(test\)\]\s*(pub\S* )?(use|mod)[^;{]*;", "", text)
            yield (
                tuple(folder) if name in ("mod", "lib") else (*folder, name),
                text.split("#[cfg(test)]\nmod tests {")[0],
            )


def imports(text):
    """Path, name in the module, and whether it is handed on, of everything that a module imports."""
    for public, tree in USE.findall(text):
        for *path, last in branches(tree):
            last, _, alias = last.partition(" as ")
            path = tuple(path if last == "self" else [*path, last])
            yield path, (alias or path[-1]).strip(), bool(public)


def dependencies(source):
    """Pairs of modules, the first of which uses the second."""
    text = dict(modules(source))
    imported = {module: list(imports(body)) for module, body in text.items()}

    def home(module, path):
        """The module that defines what a path means."""
        for n, name in enumerate(path):
            if name in ("crate", "super", "self"):
                module = {"crate": (), "super": module[:-1], "self": module}[name]
            elif (*module, name) in text:
                module = (*module, name)
            else:
                handed = [to for to, known, _ in imported[module] if known == name and to != path[n:]]
                return home(module, handed[0] + path[n + 1 :]) if handed else module
        return module

    for module, body in text.items():
        rest = re.sub(r"\b(?:use\s[^;]+|mod \w+);", "", body)
        used = set(re.findall(r"\w+", rest))
        paths = [path for path, name, public in imported[module] if not public or name in used]
        paths += [tuple(path.split("::")) for path in re.findall(r"(?<![:\w])[a-z]\w*(?:::\w+)+", rest)]
        for path in paths:
            if path[0] in ("crate", "super", "self") or (*module, path[0]) in text:
                yield module, home(module, path)


def circles(source):
    """The members of each circle, with its folder."""
    pairs = list(dependencies(source))
    for folder in {module[:n] for pair in pairs for module in pair for n in range(len(module) + 1)}:
        n = len(folder)
        inside = [pair for pair in pairs if pair[0][:n] == folder == pair[1][:n]]
        uses = {tuple("".join(module[n : n + 1]) or "mod" for module in pair) for pair in inside}
        uses = {(one, other) for one, other in uses if one != other}
        # What uses nothing that is left, or is used by nothing, is in no circle.
        while True:
            ends = {a for a, _ in uses} & {b for _, b in uses}
            if len(left := {pair for pair in uses if ends.issuperset(pair)}) == len(uses):
                break
            uses = left
        if uses:
            yield "/".join(folder), sorted({a for a, _ in uses})


@pytest.mark.parametrize("crate", sorted(path.name for path in CRATES.iterdir()))
def test_no_modules_use_each_other_in_a_circle(crate):
    assert list(circles(CRATES / crate / "src")) == []


@pytest.mark.parametrize(
    ("files", "found"),
    [
        ({"lib": "mod a; mod b;", "a": "use crate::b::B;", "b": "use crate::a::{self, A};"}, ["a", "b"]),
        (
            {"a/mod": "pub use x::X;", "a/x": "", "b": "fn f(_: crate::a::X)", "a/y": "use crate::b::B;"},
            ["a", "b"],
        ),
        ({"a": "mod x; use x::X;", "a/x": "use super::A;"}, ["mod", "x"]),
        ({"a": "mod x; pub use x::X;", "a/x": "use super::A;"}, []),
        ({"a": "use crate::b::B;", "b": "// use crate::a::A;"}, []),
        (
            {"a": "use crate::b::B;", "b": "use crate::c::C;", "c": "fn f() { super::a::f() }"},
            ["a", "b", "c"],
        ),
    ],
)
def test_a_planted_circle_is_found(files, found, tmp_path):
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.rs").write_text(text, encoding="utf-8")
    assert [names for _, names in circles(tmp_path)] == ([found] if found else [])
