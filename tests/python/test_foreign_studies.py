"""Studies of unknown origin: no link is followed, no script runs, and damage is an error of one sentence."""

import json
import re

import pyarrow as pa
import pyarrow.parquet
import pytest

import eft
from eft.cli import main
from eft.report import write_report, write_study_report
from studies import COMMAND, GRID, RIG

SCRIPT = "<script>alert(1)</script>"


@pytest.fixture
def folder(tmp_path):
    eft.study(RIG, COMMAND, GRID, output=tmp_path / "a.study", chunk=4)
    return tmp_path / "a.study"


def change(folder, path, value):
    """Set a value of the study's description."""
    file = folder / "_study.json"
    about = json.loads(file.read_text())
    *sections, last = path
    section = about
    for name in sections:
        section = section[name]
    if value is None:
        del section[last]
    else:
        section[last] = value
    file.write_text(json.dumps(about))


@pytest.mark.parametrize("name", ["_lock", "_study.json", "part-000000.parquet", "_traces"])
def test_a_link_in_the_folder_is_not_followed(name, folder, tmp_path, capsys):
    target = tmp_path / "precious"
    if name == "_traces":
        target.mkdir()
        (target / ".left.eft").write_text("precious")
    else:
        target.write_bytes((folder / name).read_bytes() or b"precious")
        (folder / name).unlink()
    before = target.read_bytes() if target.is_file() else None
    (folder / name).symlink_to(target)
    with pytest.raises(ValueError, match=rf"{name}: is a symbolic link"):
        eft.study(RIG, COMMAND, GRID, output=folder, traces=True)
    with pytest.raises(ValueError, match="symbolic link"):
        eft.Study.load(folder)
    assert before is None or target.read_bytes() == before
    assert target.is_file() or (target / ".left.eft").read_text() == "precious"


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (["study", "dtype"], SCRIPT),
        (["study", "dtype"], 3),
        (["study", "version"], 3),
        (["study", "tests"], 10**30),
        (["study", "tests"], -1),
        (["study", "tests"], "six"),
        (["study", "parameters"], None),
        (["study", "parameters", "order"], ["unknown"]),
        (["study", "parameters", "values"], {"a": {"low": "x"}}),
        (["study", "commands"], {"a": 3}),
        (["study", "commands"], {"a": {"samples": 1, "sample_rate": "fast", "sha256": ""}}),
        (["study", "traces"], None),
        (["study", "rig"], []),
        (["study", "rig"], {"a": None}),
        (["chunk"], 0),
        (["chunk"], 2),
        (["chunk"], True),
        (["columns"], []),
        (["columns"], [3]),
        (["columns", 0, "type"], "void"),
        (["columns", 0, "more"], "x"),
        (["columns", 0], None),
        (["format"], 99),
        (["format"], "1"),
    ],
)
def test_a_description_of_another_kind_is_one_sentence(folder, path, value, capsys):
    change(folder, path, value)
    assert main(["report", str(folder)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and len(said) < 600, said


@pytest.mark.parametrize(
    "text", ["", "[]", "[" * 100_000, '{"format": 1}', '{"format": 1e999}', "\x00", "9" * 5000]
)
def test_a_description_that_is_none_is_one_sentence(folder, text, capsys):
    (folder / "_study.json").write_text(text)
    assert main(["report", str(folder)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "_study.json: damaged" in said


def test_a_description_of_brackets_takes_no_memory(folder, peak_memory):
    (folder / "_study.json").write_text("[" + "[]," * 4_000_000 + "[]]")
    with peak_memory(64), pytest.raises(ValueError, match="nothing but brackets"):
        eft.Study.load(folder)


def part_of(folder):
    return folder / "part-000000.parquet"


def test_rows_of_another_kind_are_one_sentence(folder):
    part = part_of(folder)
    table = pyarrow.parquet.read_table(part)
    more = pa.concat_tables([table, table])
    words = table.set_column(table.column_names.index("nrmse"), "nrmse", pa.array(["x"] * len(table)))
    for wrong in (more, table.drop_columns(["nrmse"]), words):
        pyarrow.parquet.write_table(wrong, part)
        with pytest.raises(ValueError, match=r"part-000000\.parquet: damaged; remove it"):
            eft.Study.load(folder)["nrmse"]


def test_an_unknown_verdict_is_one_sentence(folder, tmp_path, capsys):
    part = part_of(folder)
    table = pa.parquet.read_table(part)
    place = table.schema.get_field_index("verdict")
    changed = table.set_column(place, table.schema.field(place), [["maybe"] * table.num_rows])
    pa.parquet.write_table(changed, part)
    assert main(["report", str(folder), "-o", str(tmp_path / "a.html")]) == 2
    said = capsys.readouterr().err
    assert "column verdict has 'maybe', must be one of go, caution, no" in said, said
    assert said.count("\n") == 1, said


def test_texts_that_many_rows_share_take_their_memory_once(tmp_path, peak_memory):
    rows = 100
    values = [1.0 + i / rows for i in range(rows)]
    short = eft.Command(COMMAND.values[:2], 1024.0)
    eft.study(RIG, short, {"compensation.level": values}, output=tmp_path / "s", chunk=rows, fft=False)
    part = part_of(tmp_path / "s")
    table = pyarrow.parquet.read_table(part)
    long = pa.array(["x" * 1_000_000] * rows)
    place = table.column_names.index("error")
    pyarrow.parquet.write_table(table.set_column(place, "error", long), part, compression="zstd")
    del table, long
    with peak_memory(60):
        assert len(eft.Study.load(tmp_path / "s")["error"][-1]) == 1_000_000


def test_parts_of_other_names_and_numbers_are_left_aside(folder):
    for name in ("part-x.parquet", "part-999999999.parquet", "part-.parquet"):
        (folder / name).write_bytes(part_of(folder).read_bytes())
    assert len(eft.Study.load(folder)) == 6


def runs_no_script(page):
    """The page's own script is the only one that its policy lets run."""
    text = page.read_text(encoding="utf-8")
    assert "<script>alert" not in text and "<img" not in text
    policy = re.search(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)"', text)[1]
    assert "default-src 'none'" in policy and "script-src 'sha256-" in policy
    assert "unsafe-inline" not in policy.split("script-src")[1]
    return text


def test_no_text_of_a_study_becomes_a_script(folder, tmp_path):
    part = part_of(folder)
    table = pyarrow.parquet.read_table(part)
    for name in ("status", "error", "command"):
        column = pa.array([SCRIPT] * len(table))
        table = table.set_column(table.column_names.index(name), name, column)
    pyarrow.parquet.write_table(table, part)
    change(folder, ["study", "version"], SCRIPT)
    change(folder, ["study", "rig", "name"], SCRIPT)
    change(folder, ["study", "parameters", "kind"], SCRIPT)
    text = runs_no_script(write_study_report(eft.Study.load(folder), tmp_path / "s.html", SCRIPT))
    assert text.count("&lt;script&gt;") > 3


def test_no_text_of_a_run_becomes_a_script(tmp_path):
    import dataclasses

    run = eft.simulate(RIG.replace({"name": SCRIPT}), COMMAND)
    run = dataclasses.replace(run, version=SCRIPT, dtype=SCRIPT)
    for runs in (run, {SCRIPT: run, '"><img src=x onerror=alert(1)>': run}):
        runs_no_script(write_report(runs, tmp_path / "r.html", SCRIPT))


def test_no_name_of_a_record_becomes_a_script_in_the_demonstration(tmp_path):
    from eft.demo.report import _html

    text = _html(f"# Report of {SCRIPT}\n\n{SCRIPT} ![x](https://example.org/x.png)\n", tmp_path)
    assert "<script" not in text and "default-src 'none'" in text
