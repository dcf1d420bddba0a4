#!/usr/bin/env python3
"""Follows the pages "Link the core into your firmware" exactly, each in its own folder.

A code block whose first line is a comment with a path is written to that path. A block of the shell is run,
and a warning is an error. A missing program is an error, or with ALLOW_SKIPS=1 a remark.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEEDED = ("cargo", "cmake", "pkg-config", "qemu-system-arm", "arm-none-eabi-gcc", "eft")
FENCE = re.compile(r"^```(?P<language>\w+)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"^(?:#|//|/\*) (?P<path>[\w./-]+\.\w+)(?: \*/)?$")


def follow(page: Path, environment: dict[str, str]) -> int:
    """Follow one page; returns the number of its used blocks."""
    used = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "eft").symlink_to(ROOT)
        for block in FENCE.finditer(page.read_text(encoding="utf-8")):
            body = block["body"]
            if block["language"] == "sh":
                script = ["bash", "-euo", "pipefail", "-c", body]
                done = subprocess.run(
                    script, cwd=folder, env=environment, text=True, capture_output=True, timeout=600
                )
                said = f"{done.stdout}{done.stderr}"
                if done.returncode or "warning:" in said:
                    sys.exit(f"{page.name}: this ended with {done.returncode}:\n{body}\n{said}")
            elif named := NAME.match(body.splitlines()[0]):
                path = folder / named["path"]
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(body, encoding="utf-8")
            else:
                continue
            used += 1
    return used


def main() -> None:
    """Follow both pages."""
    environment = dict(os.environ)
    environment["PATH"] = f"{ROOT / '.venv/bin'}:{environment['PATH']}"
    # The page's own toolchain, not that of this process.
    for name in ("RUSTUP_TOOLCHAIN", "RUSTC_WRAPPER", "CARGO_TARGET_DIR"):
        environment.pop(name, None)
    if missing := [program for program in NEEDED if not shutil.which(program, path=environment["PATH"])]:
        said = f"the pages are not followed: {', '.join(missing)} not installed"
        if os.environ.get("ALLOW_SKIPS") != "1":
            sys.exit(f"{said}; nothing is skipped without ALLOW_SKIPS=1")
        print(said)
        return
    for page, blocks in (("firmware-rust.md", 7), ("firmware-c.md", 7)):
        used = follow(ROOT / "docs" / "how-to" / page, environment)
        if used != blocks:
            sys.exit(f"{page}: {used} blocks were used, {blocks} expected")
        print(f"{page}: followed, {used} blocks")


if __name__ == "__main__":
    main()
