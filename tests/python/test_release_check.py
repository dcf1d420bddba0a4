"""`.ci/release-check` stops at the first failure. Stubs replace the programs that it calls."""

import os
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Packs an archive whose checksum is wrong.
ARCHIVE = """#!/bin/bash
name=eft-0-$1
mkdir -p "$2/$name/lib" && touch "$2/$name/lib/libeft.a"
tar -C "$2" -czf "$2/$name.tar.gz" "$name"
printf '%064d  %s\\n' 0 "$name.tar.gz" >"$2/$name.tar.gz.sha256"
"""
PROGRAMS = ("cargo", "cargo-zigbuild", "cmake", "maturin", "python", "qemu-aarch64", "x86_64-w64-mingw32-gcc")


def _program(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(0o755)


def test_a_wrong_checksum_ends_the_whole_check(tmp_path):
    programs = tmp_path / "target" / "release-check" / "bin"
    for name in PROGRAMS:
        _program(programs / name, "#!/bin/bash\n")
    _program(programs / "rustup", "#!/bin/bash\n[[ $2 != list ]] || echo thumbv6m-none-eabi\n")
    _program(tmp_path / ".ci" / "archive", ARCHIVE)
    shutil.copy(ROOT / ".ci" / "release-check", tmp_path / ".ci")
    (tmp_path / "firmware").mkdir()
    path = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}
    run = subprocess.run(
        [tmp_path / ".ci" / "release-check"], env=path, capture_output=True, text=True, timeout=60
    )
    assert run.returncode != 0
    assert "thumbv6m-none-eabi.tar.gz: FAILED" in run.stdout
    assert "linked" not in run.stdout
