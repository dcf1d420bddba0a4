"""Judges a test by numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eft import _native
from eft._run_spectra import check_command
from eft._table import Metrics

if TYPE_CHECKING:
    from eft._run import TestRun


def metrics(run: TestRun, *, fft: bool = True) -> Metrics:
    """Compare the true force with the command, and the motion with the ideal response.

    Parameters
    ----------
    fft : bool
        Whether to compute the metrics that take longer than the test. These are ``displacement_error``
        and the metrics that need a Fourier transform: ``delay``, ``nrmse_delay_removed`` and the
        evaluation index.

    Returns
    -------
    Metrics
        Numbers by name, as items and as attributes. For several actuators they are arrays with one number
        each, which is NaN if the command is zero. A metric without an answer is NaN, such as the delay of
        a force that stays zero, or the displacement error of an external structure.

        - ``nrmse``: rms error over rms command
        - ``nrmse_delay_removed``, ``nrmse_bias_free``: the same without the delay, without the offset
        - ``peak_error``: largest error over the largest command
        - ``delay``: by cross-correlation, s, positive when the force lags
        - ``fei_amplitude``, ``fei_delay`` (s), ``fei_frequency`` (Hz): frequency-domain evaluation index
        - ``oscillation``: rms error from 30 to 150 Hz over rms command
        - ``tracking_indicator``: N², negative when the force lags
        - ``displacement_error``: rms error of the displacement against `eft.ideal_response`, over its rms
        - ``max_spool``: largest opening
        - ``drift``: largest drift of the story, m
        - ``min_supply_pressure``: Pa

    Raises
    ------
    ValueError
        If the command is zero throughout.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.0, 5.0, 4.0, 1024.0))
    >>> metrics = run.metrics()
    >>> round(metrics["nrmse"], 3) == round(metrics.nrmse, 3)
    True
    """
    kept: dict[bool, Metrics] = run.__dict__.setdefault("_judged", {})
    if fft not in kept:
        kept[fft] = _judged(run, fft)
    return kept[fft]


def _judged(run: TestRun, fft: bool) -> Metrics:
    if run.command.ndim > 1:
        check_command(run)
    if run._building is not None and run.command.any():
        # The ideal motion of one floor needs the commands of the other floors.
        building, index = run._building
        found = building.metrics(fft=fft)
        return Metrics({str(name): float(values[index]) for name, values in found.items()})
    signals = (run.command, run.force, run.displacement, run.spool, run.supply_pressure)
    judged = _native.judge_test(run.rig, run.sample_rate, *signals, fft)
    if run._outside and "displacement_error" in judged:
        judged["displacement_error"] = [np.nan] * len(judged["displacement_error"])
    if run.command.ndim > 1:
        return Metrics({name: np.array(values) for name, values in judged.items()})
    return Metrics({name: value for name, [value] in judged.items()})
