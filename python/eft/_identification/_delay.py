"""The delay of a response behind its command."""

from __future__ import annotations

from numpy.typing import ArrayLike

from eft import _native
from eft._identification._estimate import Array, Estimate, make_estimate


class DelayEstimate(Estimate):
    """A delay in s, and the line fitted to the phase; its slope is the delay."""

    __slots__ = {
        "coherence": "1 if all phases lie on the line.",
        "frequency": "Frequency of every excited bin, Hz.",
        "intercept": "Intercept of the line, rad.",
        "lag": "Phase lag at each frequency, rad.",
    }

    intercept: float
    coherence: float
    frequency: Array
    lag: Array


def identify_delay(
    command: ArrayLike, response: ArrayLike, sample_rate: float, band: tuple[float, float] = (0.25, 10.0)
) -> DelayEstimate:
    """Estimate the delay of a response from the slope of phase against frequency (Fig. 4a).

    Samples that are NaN or masked are gaps. Gaps of up to a tenth of the period of the band's highest
    frequency are bridged by straight lines, and the signals are faded at longer ones. Offset and linear
    drift are removed. The ends of the recording are faded over two periods of the band's highest frequency,
    so a recording may end in motion.

    Parameters
    ----------
    command, response : array_like
        Simultaneous samples, one dimension, of any unit.
    sample_rate : float
        In Hz.
    band : tuple of float
        Frequencies in Hz between which the line is fitted, with an intercept.

    Returns
    -------
    DelayEstimate
        The delay in s, positive when the response lags, with its ``uncertainty``; ``intercept`` (rad) and
        ``coherence`` (1 where all phases lie on the line); ``frequency`` (Hz) and ``lag`` (rad) of every
        excited bin.

    Notes
    -----
    The uncertainty contains the noise of both signals and the scatter of the phases about a line. Of 100
    random resonant motions of 4 to 28 s with noise up to 0.2 %, cut off in motion, 90 to 99 % must have the
    true delay within two uncertainties in the tests. A recording of nearly one frequency is refused.

    Raises
    ------
    ValueError
        If the data do not determine the delay, as in a band that the command does not excite or where the
        response is noise; if the response has the sign opposite to the command; the message says why.

    Examples
    --------
    >>> import eft
    >>> test = eft.identification.valve_test(eft.Rig.zhao2005())
    >>> delay = eft.identify_delay(test.valve_command, test.spool, 2048.0)
    >>> f"{1e3 * delay:.1f} ms"
    '5.4 ms'
    """
    found = _native.identify_delay(command, response, sample_rate, band)
    answer = make_estimate(DelayEstimate, found.pop("value"), found)
    assert isinstance(answer, DelayEstimate)
    return answer
