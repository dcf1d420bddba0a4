"""The paper's sweeps as data: complete, and compared as documented."""

import dataclasses

import pytest

from eft import paper


def test_every_figure_has_its_sweeps():
    cases = paper.load().cases
    by_figure = {name: [c.label for c in cases if name in c.figures] for name in ("8", "11a", "11b")}
    assert by_figure["8"] == ["off", "linear", "nonlinear"]
    assert by_figure["11a"] == ["level 0.98", "level 1.00", "level 1.02"]
    assert len(by_figure["11b"]) == 3
    assert sum(case.reference is not None for case in cases) == 7
    assert len({case.key for case in cases}) == len(cases)


def test_a_value_may_differ_by_two_percent_and_a_frequency_by_one_bin():
    data = paper.load()
    reference = data.cases[2].reference
    bin_width = 1 / data.sweep.duration

    def far(**changes):
        run = dataclasses.replace(reference, **changes)
        return [c.name for c in paper.compare(reference, run, data) if not c.within]

    assert far() == []
    assert far(nrmse=reference.nrmse * 1.019, ratio_min_at=reference.ratio_min_at + bin_width) == []
    assert far(nrmse=reference.nrmse * 1.021) == ["nrmse"]
    assert far(max_spool=reference.max_spool * 0.979) == ["max_spool"]
    assert far(ratio_max_at=reference.ratio_max_at - 2 * bin_width) == ["ratio_max_at"]


def test_a_nan_is_never_within():
    data = paper.load()
    reference = data.cases[0].reference
    run = dataclasses.replace(reference, nrmse=float("nan"))
    assert [c.name for c in paper.compare(reference, run, data) if not c.within] == ["nrmse"]


def test_a_deviation_says_what_it_is():
    data = paper.load()
    reference = data.cases[0].reference
    run = dataclasses.replace(reference, nrmse=reference.nrmse * 1.5)
    (told,) = [str(c) for c in paper.compare(reference, run, data) if not c.within]
    assert "nrmse" in told and "50.0%" in told
    assert pytest.approx(0.5288) == reference.nrmse
