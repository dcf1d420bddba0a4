"""Configuration files of unknown origin: a short and fast error for any size and shape."""

import json
import os
import time

import pytest

import eft
from eft._test_file import TestPlan
from eft.cli import main
from eft.cli._plan import memory_of

SWEEP = '[command]\nkind = "sweep"\namplitude = 1.0\nf_start = 0.5\nf_end = 4.0\nduration = 1.0\n'
MANY = "a." * 100_000 + "a"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"{MANY} = 1\n", "line 1: a key of more than 32 parts"),
        (f"\n[{MANY}]\n", "line 2: a key of more than 32 parts"),
        (f"a = {{ {MANY} = 1 }}\n", "more than 32 parts"),
        ("'a' . " * 100_000 + "a = 1\n", "more than 32 parts"),
        ('"=".' * 100_000 + "a = 1\n", "more than 32 parts"),
        ("a = " + "[" * 100_000, "nested too deeply"),
        ("a = " + "{a=" * 100_000, "nested too deeply"),
        ("a" * 100_000 + " = 1\n" + SWEEP, "unknown key"),
        ("structure." + "a" * 100_000 + " = 1\n" + SWEEP, "unknown key"),
        ("[command]\n" + "a" * 100_000 + " = 1\n", "command.kind missing"),
        (SWEEP + "a" * 100_000 + " = 1\n", "unknown key"),
        (SWEEP + "scale = '" + "a" * 100_000 + "'\n", "unknown key"),
        ("a = " + "9" * 100_000, "line 1"),
        ('"' * 100_001, "line 1"),
        ("a" + " " * 100_000 + "." + " " * 100_000 + "b\n", "line 1"),
        ("." * 100_000, "line 1"),
    ],
)
def test_any_text_gets_a_short_answer_at_once(text, says, tmp_path, capsys):
    path = tmp_path / "test.toml"
    path.write_text(text if "[command]" not in text else eft.Rig.zhao2005().to_toml() + text)
    began = time.monotonic()
    assert main(["run", str(path)]) == 2
    assert time.monotonic() - began < 3.0
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1 and len(said) < 1200, said[:600]


ADAPTIVE = ["run", "--sweep", "100", "0.5", "4", "1", "--set", "compensation.adaptive=true"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"[calibration]\n{MANY} = 1\n", "line 2: a key of more than 32 parts"),
        (f'[calibration]\n"{MANY}" = 1\n', "32 parts"),
        (f'"calibration.{MANY}" = 1\n', "32 parts"),
        ("a = " + "[" * 100_000, "nested too deeply"),
        ("[calibration]\nx = " + "{a = " * 30_000, "nested too deeply"),
        ("[calibration]\n" + "".join(f"k{n} = 1\n" for n in range(50_000)), "unknown key"),
        ("#" * 5_000_000, "larger than"),
        ("\ufeff[calibration]\nflow_gain = 'wide'\n", "flow_gain"),
    ],
)
def test_any_calibration_gets_a_short_answer_at_once(text, says, tmp_path, capsys):
    path = tmp_path / "calibration.toml"
    path.write_text(text, "utf-8")
    began = time.monotonic()
    assert main([*ADAPTIVE, "--calibration", str(path)]) == 2
    assert time.monotonic() - began < 3.0
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1 and len(said) < 1200, said[:600]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_calibration_from_a_pipe_or_device_is_refused_at_once(tmp_path, capsys):
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/zero"):
        assert main([*ADAPTIVE, "--calibration", str(path)]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and "must be an ordinary file" in said, said[:600]


@pytest.mark.parametrize("parts", [33, 50_001, 1_000_000])
def test_a_key_of_many_parts_is_unknown_at_once(parts, capsys):
    key = "a." * (parts - 1) + "a"
    began = time.monotonic()
    with pytest.raises(ValueError, match=r"unknown key `a\.a\.a"):
        eft.Rig.zhao2005().replace({key: 1.0})
    assert main([*ADAPTIVE, "--set", f"{key}=1"]) == 2
    assert time.monotonic() - began < 3.0
    said = capsys.readouterr().err
    assert "unknown key" in said and said.count("\n") == 1 and len(said) < 1200, said[:600]


def test_a_test_of_much_memory_is_refused_unless_it_is_asked_for(capsys):
    # 16.4 million samples.
    test = ["--sweep", "1", "0.5", "1", "4000", "--sample-rate", "4096"]
    assert main(["run", *test]) == 2
    said = capsys.readouterr().err
    assert "16384000 samples need 3.1 GiB of memory" in said and "--memory 4 lets it run" in said
    assert main(["check", *test, "--memory", "3"]) == 2
    assert "at most the 3 GiB of --memory" in capsys.readouterr().err
    small = ["--sweep", "1", "0.5", "1", "4", "--sample-rate", "4096"]
    assert main(["check", *small, "--memory", "0.001"]) == 2
    assert main(["check", *small, "--memory", "0.01", "--json"]) in (0, 1)
    assert json.loads(capsys.readouterr().out)["memory"] == pytest.approx(4 * 4096 * 200 / 1024**3)
    masses = {"structure.kind": "shear_building"}
    building = TestPlan({**masses, "structure.stories.masses": [1.0] * 3}, [0.0] * 100, "")
    assert memory_of(building) == pytest.approx(3 * 100 * 200 / 1024**3)


def test_a_study_of_much_memory_is_refused_unless_it_is_asked_for(tmp_path, capsys):
    study = tmp_path / "study.toml"
    sweep = SWEEP.replace("duration = 1.0", "duration = 4000.0") + "sample_rate = 4096.0\n"
    grid = "[study]\nfft = false\n[study.grid]\n'servovalve.flow_gain_scale' = "
    for scales, tests in (("[1.0]", "1 test"), ("[0.9, 1.0]", "2 tests")):
        study.write_text(eft.Rig.zhao2005().to_toml() + sweep + grid + scales + "\n")
        assert main(["study", str(study)]) == 2
        said = capsys.readouterr().err
        need = int(tests[0]) * 16384000 * 200 / 1024**3
        assert f"16384000 samples in {tests} at a time need {need:.1f} GiB of memory" in said
        assert "lets it run" in said and said.count("\n") == 1
        assert not (tmp_path / "study.study").exists()
    study.write_text(eft.Rig.zhao2005().to_toml() + SWEEP + grid + "[1.0]\n")
    assert main(["study", str(study), "--memory", "0.0001"]) == 2
    assert main(["study", str(study)]) == 0


def test_dots_in_texts_are_not_keys(tmp_path):
    path = tmp_path / "rig.toml"
    rig = eft.Rig.zhao2005().replace({"name": "1.2.3.4.5.6.7.8"})
    path.write_text(rig.to_toml() + SWEEP)
    assert eft.cli.main(["check", str(path)]) in (0, 1)
