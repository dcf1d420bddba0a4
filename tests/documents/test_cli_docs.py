"""The page of the command line names every command, and `eft run` reads its TOML."""

import re
from pathlib import Path

from eft.cli import main

ROOT = Path(__file__).resolve().parents[2]


def test_the_pages_name_every_command():
    from eft.cli._main import cli

    text = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `eft (\w+)`", text, re.MULTILINE)) == set(cli.commands)


def test_tests_of_the_page_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    sweep, quake, study = re.findall(r"^```toml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert main(["init"]) == 0
    Path("quake.toml").write_text(quake, encoding="utf-8")
    Path("sweep.toml").write_text(Path("rig.toml").read_text(encoding="utf-8") + sweep, encoding="utf-8")
    assert main(["run", "sweep.toml"]) == 0
    assert main(["run", "quake.toml"]) == 0
    Path("study.toml").write_text(study, encoding="utf-8")
    assert main(["study", "study.toml"]) == 0
