"""The figures: their content and units, and that they change no setting of Matplotlib."""

import warnings

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
import pictures
from eft import plots
from fakes import FakeRun


def new_axes():
    return Figure().subplots()


def curve(ax, label):
    (line,) = [line for line in ax.get_lines() if line.get_label() == label]
    return line.get_data()


def test_force_history_draws_both_forces_in_kilonewton_inside_the_window():
    run = FakeRun()
    ax = plots.force_history(run, window=(4.0, 8.0), ax=new_axes())
    time, command = curve(ax, "command")
    assert time[0] == 4.0 and time[-1] == 8.0
    assert command.max() == pytest.approx(run.amplitude / 1e3, rel=1e-3)
    assert curve(ax, "measured")[1].max() == pytest.approx(run.share * run.amplitude / 1e3, rel=1e-3)
    assert ax.get_xlabel() == "time (s)" and ax.get_ylabel() == "force (kN)"


def test_spectrum_of_a_sine_peaks_at_its_frequency_with_half_its_impulse():
    # |Fourier transform| of a·sin over T seconds is a·T/2 at its own frequency.
    run = FakeRun(frequency=2.0, duration=10.0, amplitude=5000.0)
    ax = plots.force_spectrum({"one": run}, band=(0.0, 10.0), ax=new_axes())
    frequency, amplitude = curve(ax, "command")
    assert frequency[amplitude.argmax()] == pytest.approx(2.0)
    assert amplitude.max() == pytest.approx(5.0 * 10.0 / 2)
    assert curve(ax, "one")[1].max() == pytest.approx(run.share * 5.0 * 10.0 / 2)
    assert frequency[0] >= 0.0 and frequency[-1] <= 10.0


def test_ratio_is_that_of_the_run():
    ax = plots.force_ratio({"half": FakeRun(share=0.5)}, band=(1.0, 3.0), ax=new_axes())
    frequency, ratio = curve(ax, "half")
    np.testing.assert_allclose(ratio, 0.5)
    assert frequency.min() >= 1.0 and frequency.max() <= 3.0


def test_hysteresis_recovers_the_spring_from_force_and_motion():
    # A sine response of a linear structure needs F = (k − m·ω²)·x + c·ẋ, and the figure must give back k·x.
    mass, damping, stiffness, omega = 2.0, 3.0, 700.0, 2 * np.pi
    run = FakeRun(frequency=1.0, duration=4.0, sample_rate=2000.0)
    run.force = (stiffness - mass * omega**2) * run.displacement + damping * run.velocity
    run.rig = run.rig.replace({"truth.structure.mass": mass, "truth.structure.damping": damping})
    ax = plots.hysteresis(run, ax=new_axes())
    displacement, force = ax.get_lines()[0].get_data()
    np.testing.assert_allclose(force * 1e3, stiffness * displacement / 1e3, atol=1e-4 * stiffness * 0.05)
    assert ax.get_xlabel() == "displacement (mm)"


HISTORIES = [plots.force_history, plots.displacement_history, plots.velocity_history, plots.spool_history]


@pytest.mark.parametrize("draw", HISTORIES)
def test_histories_mark_the_moment_of_a_trip_with_its_cause(draw):
    rig = eft.Rig.zhao2005().replace({"protection.enabled": True, "protection.force_trip": 4000.0})
    run = eft.simulate(rig, eft.sine_sweep(8900.0, 0.5, 6.0, 6.0, 1024.0))
    at = int(((run.status & np.uint32(eft.Status.TRIPPED)) != 0).argmax()) / 1024.0
    assert 0.0 < at < 5.0
    assert list(curve(draw(run, ax=new_axes()), "tripped: force level")[0]) == [at, at]
    # Not if the window shows another time, and not in a complete test.
    labels = [line.get_label() for line in draw(run, window=(at + 0.1, 6.0), ax=new_axes()).get_lines()]
    labels += [line.get_label() for line in draw(FakeRun(), ax=new_axes()).get_lines()]
    assert not any(str(label).startswith("tripped") for label in labels)


def test_the_page_of_a_run_marks_where_it_left_its_stroke():
    run = eft.simulate(
        eft.Rig.zhao2005().replace({"compensation.level": 2.0}),
        eft.sine_sweep(2000.0, 0.0, 10.0, 4.0, 1024.0),
    )
    force, error, displacement, spool, _ = plots.run_page(run, figure=Figure()).axes
    for ax in (force, displacement, spool):
        assert curve(ax, "left its stroke")[0][0] == run.to_its_end().duration
    assert "_end" in [line.get_label() for line in error.get_lines()]


def test_spool_is_shown_against_the_advised_opening():
    ax = plots.spool_history(FakeRun(), ax=new_axes())
    assert curve(ax, "spool")[1].max() == pytest.approx(80.0, rel=1e-3)
    levels = {round(float(np.asarray(line.get_ydata())[0])) for line in ax.get_lines()}
    assert {60, -60} <= levels


def test_ideal_response_lies_beneath_the_run():
    ax = plots.displacement_history({"nonlinear": FakeRun()}, ideal=FakeRun(), ax=new_axes())
    assert [line.get_label() for line in ax.get_lines()] == ["ideal", "nonlinear"]
    ax = plots.velocity_history({"nonlinear": FakeRun()}, ideal=FakeRun(), ax=new_axes())
    assert curve(ax, "ideal")[1].max() == pytest.approx(0.05 * 4 * np.pi, rel=1e-6)


def test_schemes_keep_their_look_whatever_stands_beside_them():
    alone = plots.force_history({"nonlinear": FakeRun()}, ax=new_axes())
    among = plots.force_history({s: FakeRun() for s in ("off", "linear", "nonlinear")}, ax=new_axes())
    look = [
        next(line.get_color() for line in ax.get_lines() if line.get_label() == "nonlinear")
        for ax in (alone, among)
    ]
    assert look[0] == look[1]
    assert len({line.get_color() for line in among.get_lines()}) == 4


@pytest.mark.parametrize(
    ("window", "says"),
    [((8.0, 4.0), "start must lie before its end"), ((20.0, 30.0), "fewer than two samples")],
)
def test_window_outside_the_run_is_refused(window, says):
    with pytest.raises(ValueError, match=says):
        plots.force_history(FakeRun(duration=10.0), window=window, ax=new_axes())


def test_no_runs_is_an_error():
    with pytest.raises(ValueError, match="at least one run"):
        plots.force_spectrum({}, ax=new_axes())


def test_whole_figures_draw_without_warning_and_change_no_global_style():
    before = mpl.rcParams.copy()
    runs = {
        scheme: FakeRun(share=share) for scheme, share in (("off", 0.2), ("linear", 0.8), ("nonlinear", 1.0))
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figures = [
            plots.figure_8(runs),
            plots.figure_8_ratio(runs),
            plots.figure_9(runs),
            plots.figure_10(runs, FakeRun()),
            plots.figure_11(runs),
            plots.figure_structure(runs["nonlinear"]),
        ]
        for figure in figures:
            pictures.drawn(figure)
            for ax in figure.axes:
                assert ax.get_ylabel(), "an axis without a label and unit"
    assert mpl.rcParams.copy() == before
