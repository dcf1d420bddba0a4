"""The demonstration as a user starts it: its output, its files, its errors."""

import re

import pytest

from eft.demo import experiments, figures
from eft.demo.__main__ import main

pytestmark = pytest.mark.usefixtures("quick_pictures")


@pytest.fixture(scope="module", autouse=True)
def sweeps_once():
    """Both demonstrations have the same sweeps."""
    sweep, kept = experiments.sweep, {}

    def once(case):
        if case.title not in kept:
            kept[case.title] = sweep(case)
        return kept[case.title]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiments, "sweep", once)
        yield


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    return main(["--short", "--output", str(folder)]), folder


def test_short_demo_meets_the_paper(short):
    code, folder = short
    assert code == 0, (folder / "report.md").read_text(encoding="utf-8")


def test_report_shows_every_figure_it_names_and_no_other_file_is_left(short):
    _, folder = short
    text = (folder / "report.md").read_text(encoding="utf-8")
    named = set(re.findall(r"\]\(([\w.-]+\.png)\)", text))
    assert named == {path.name for path in folder.glob("*.png")}
    assert len(named) == 5
    assert {path.name for path in folder.iterdir()} == named | {"report.md", "report.html"}


def test_html_report_needs_nothing_beside_it(short):
    _, folder = short
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count('src="data:image/png;base64,') == 5
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert "All 21 reference numbers are met" in page


def test_a_record_that_is_not_there_costs_one_line_and_no_run(tmp_path, capsys):
    code = main(["--record", str(tmp_path / "nowhere.at2"), "--output", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert code == 2
    assert said.out == ""
    assert "nowhere.at2" in said.err and said.err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_output_that_cannot_be_is_said_before_anything_runs(tmp_path, capsys):
    (tmp_path / "file").touch()
    code = main(["--output", str(tmp_path / "file" / "out")])
    said = capsys.readouterr()
    assert code == 2
    assert said.out == ""
    assert "file" in said.err and said.err.count("\n") == 1


@pytest.mark.parametrize("scale", ["0", "nan", "inf", "fast"])
def test_a_scale_that_means_nothing_is_refused(scale, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--scale", scale])
    assert stop.value.code == 2
    assert scale in capsys.readouterr().err


def test_own_record_and_scale_are_used(tmp_path, monkeypatch):
    # The first demonstration has drawn them.
    monkeypatch.setattr(figures, "sweeps", lambda results: [])
    record = tmp_path / "pulse.csv"
    lines = [f"{0.01 * i:.2f},{0.5 if 100 <= i < 120 else 0.0}" for i in range(400)]
    record.write_text("time (s),acceleration (m/s2)\n" + "\n".join(lines) + "\n")
    code = main(["--short", "--record", str(record), "--scale", "2", "--output", str(tmp_path / "out")])
    assert code == 0
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    # 7040 kg times 0.5 m/s² times 2.
    assert "the command peaks at 7.0 kN" in text
