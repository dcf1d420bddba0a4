"""A servovalve from its measured or published frequency response."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft._foreign import read_text
from eft._identification import Estimate
from eft._read_only import ReadOnly, read_only
from eft.data_sheets._values import above_zero
from eft.data_sheets._valve import second_order

__all__ = ["FrequencyResponse", "ValveEstimate", "identify_valve", "read_frequency_response"]

_LARGEST = 4 * 1024**2
"""Largest size of a file with a frequency response, in bytes."""

_LARGEST_MISFIT = 0.4
"""Largest rms difference between response and fit, over that of the response."""

_COLUMNS = {
    "frequency": (("frequency", "freq", "f"), {"hz": 1.0, "khz": 1e3, "rad/s": 0.5 / math.pi}),
    "amplitude": (
        ("amplitude", "gain", "magnitude", "ratio"),
        {"db": math.nan, "1": 1.0, "-": 1.0, "%": 1e-2},
    ),
    "phase": (("phase", "lag"), {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}),
}
"""Allowed names and units of a column; dB is logarithmic."""


class FrequencyResponse(NamedTuple):
    """A measured frequency response of spool over command."""

    frequency: NDArray[np.float64]
    """In Hz."""
    amplitude: NDArray[np.float64]
    """Spool over command, a ratio."""
    phase: NDArray[np.float64]
    """In rad, negative where the spool lags."""


@dataclass(frozen=True, eq=False)
class ValveEstimate(ReadOnly):
    """A spool of second order, fitted to a frequency response."""

    natural_frequency: Estimate
    """Where the phase is -90°, Hz."""
    damping_ratio: Estimate
    """Of the spool."""
    response_delay: Estimate
    """Limit at low frequency, ``2ζ/ω_n``, s."""
    misfit: float
    """Rms of the difference between response and fit, over rms of the response."""
    frequency: NDArray[np.float64]
    """Of the data, Hz."""
    response: NDArray[np.complex128]
    """The data, over its gain at rest."""
    fit: NDArray[np.complex128]
    """The fit at the same frequencies."""

    def _repr_html_(self) -> str:
        from eft import _notebook

        names = ("natural_frequency", "damping_ratio", "response_delay")
        rows: list[tuple[str, Any]] = [(name.replace("_", " "), repr(getattr(self, name))) for name in names]
        return _notebook.shown("Valve", [*rows, ("misfit", f"{self.misfit:.1%}")])

    def keys(self, rated_signal: float = 10.0) -> dict[str, Any]:
        """Keys for `Rig.replace`; `rated_signal` (V) opens the spool fully.

        Parameters
        ----------
        rated_signal : float
            Valve command that opens the spool fully, V.

        Returns
        -------
        dict
            Keys with their values.

        Raises
        ------
        ValueError
            If the signal is not allowed.

        Examples
        --------
        >>> import eft, numpy
        >>> frequency = numpy.array([1.0, 10.0, 30.0, 60.0, 90.0])
        >>> response = 1.0 / (1.0 + 1.4j * frequency / 60.0 - (frequency / 60.0) ** 2)
        >>> amplitude, phase = abs(response), numpy.unwrap(numpy.angle(response))
        >>> found = eft.identification.identify_valve(frequency, amplitude, phase)
        >>> sorted(found.keys())[0]
        'compensation.response_delay'
        """
        omega = 2.0 * math.pi * float(self.natural_frequency)
        return second_order(omega, float(self.damping_ratio), above_zero("rated_signal", rated_signal, "V"))


def identify_valve(frequency: ArrayLike, amplitude: ArrayLike, phase: ArrayLike) -> ValveEstimate:
    """Fit a spool of second order to a frequency response of spool over command.

    The inverse response ``(1 + 2ζs/ω_n + s²/ω_n²)/g`` is linear in its coefficients. It is fitted by least
    squares, with weights that give the relative error of every point the same importance.

    Parameters
    ----------
    frequency : array_like
        In Hz, at least four different ones.
    amplitude : array_like
        Spool over command, a ratio of any unit above zero.
    phase : array_like
        In rad, negative where the spool lags.

    Returns
    -------
    ValveEstimate
        Natural frequency, damping ratio and delay, with one standard deviation each from the misfit.

    Raises
    ------
    ValueError
        If the data do not determine the valve; the message says why.

    Examples
    --------
    >>> import eft, numpy as np
    >>> f = np.geomspace(2.0, 150.0, 30)
    >>> h = 1.0 / (1.0 + 1.8j * f / 60.0 - (f / 60.0) ** 2)
    >>> found = eft.identification.identify_valve(f, abs(h), np.angle(h))
    >>> f"{found.natural_frequency:.1f} Hz, {found.damping_ratio:.2f}"
    '60.0 Hz, 0.90'
    """
    f, size, angle = (np.asarray(values, dtype=np.float64) for values in (frequency, amplitude, phase))
    for name, values in (("frequency", f), ("amplitude", size), ("phase", angle)):
        if values.ndim != 1 or len(values) != len(f):
            raise ValueError(f"{name} = array of shape {values.shape}: must be one value per frequency")
        if not np.isfinite(values).all():
            raise ValueError(f"{name} = {values[~np.isfinite(values)][0]}: must be finite")
    for name, values in (("frequency", f), ("amplitude", size)):
        if (values <= 0.0).any():
            raise ValueError(f"{name} = {values.min():g}: must be above zero")
    if len(np.unique(f)) < 4:
        raise ValueError(f"frequency = {len(np.unique(f))} different values: must be at least 4")
    measured = size * np.exp(1j * angle)
    omega = 2.0 * np.pi * f
    scale = float(np.exp(np.log(omega).mean()))  # scales the columns to a similar size
    s = omega / scale
    columns = np.vstack(
        [np.column_stack([np.ones_like(s), 0.0 * s, -(s**2)]), np.column_stack([0.0 * s, s, 0.0 * s])]
    )
    inverse = 1.0 / measured
    target = np.concatenate([inverse.real, inverse.imag])
    weight = np.tile(size, 2)
    rows, right = columns * weight[:, None], target * weight
    found, *_ = np.linalg.lstsq(rows, right, rcond=None)
    b0, b1, b2 = found
    if not (b0 > 0.0 and b1 > 0.0 and b2 > 0.0):
        raise ValueError(
            "frequency response: the phase must decrease as that of a stable valve of second order"
        )
    left = right - rows @ found
    noise = float(left @ left) / max(len(left) - 3, 1)
    spread = noise * np.linalg.inv(rows.T @ rows)

    def estimate(value: float, gradient: list[float]) -> Estimate:
        slope = np.array(gradient)
        return Estimate(value, float(np.sqrt(slope @ spread @ slope)))

    natural = scale * math.sqrt(b0 / b2) / (2.0 * math.pi)
    damping = b1 / (2.0 * math.sqrt(b0 * b2))
    delay = b1 / (b0 * scale)
    fit = 1.0 / (1.0 + 1j * s * b1 / b0 - s**2 * b2 / b0)
    own = measured * b0
    misfit = float(np.sqrt(np.mean(np.abs(own - fit) ** 2) / np.mean(np.abs(own) ** 2)))
    if misfit > _LARGEST_MISFIT:
        raise ValueError(
            f"frequency response: differs from that of second order by {misfit:.0%} (rms): must be at most "
            f"{_LARGEST_MISFIT:.0%}: check the units of amplitude and phase, or leave out high frequencies"
        )
    return ValveEstimate(
        estimate(natural, [0.5 * natural / b0, 0.0, -0.5 * natural / b2]),
        estimate(damping, [-0.5 * damping / b0, damping / b1, -0.5 * damping / b2]),
        estimate(delay, [-delay / b0, delay / b1, 0.0]),
        misfit,
        f,
        own,
        fit,
    )


def read_frequency_response(
    path: str | PathLike[str],
) -> FrequencyResponse:
    r"""Read frequency (Hz), amplitude ratio and phase (rad) from a CSV file.

    The header names each column and its unit: frequency in Hz, kHz or rad/s; amplitude or gain in dB, 1 or %;
    phase in deg or rad, negative where the spool lags. Cells are separated by commas, semicolons or tabs.
    Between semicolons or tabs, numbers may have decimal commas.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    FrequencyResponse
        Frequency, amplitude ratio and phase, in the order of `identify_valve`.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If a column or a unit is missing, or a cell is not a number; the message names line and column.

    Examples
    --------
    >>> import tempfile
    >>> import eft
    >>> text = "frequency (Hz),gain (dB),phase (deg)\n1,0,-1\n20,-1,-25\n50,-4,-75\n90,-9,-125\n"
    >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
    ...     _ = file.write(text)
    ...     file.flush()
    ...     found = eft.identification.read_frequency_response(file.name)
    >>> found.frequency.tolist()
    [1.0, 20.0, 50.0, 90.0]
    """
    path = Path(path)
    lines = read_text(path, _LARGEST, "frequency response").lstrip("\ufeff").splitlines()
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{path}: is empty, must have a header and one line per frequency")
    separator = next((one for one in ";\t" if one in lines[0]), ",")
    header, *rows = list(csv.reader(lines, delimiter=separator))
    if separator != ",":
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    answer = []
    for name, (aliases, units) in _COLUMNS.items():
        column, unit = _column(path, header, name, aliases, units)
        values = np.array(
            [_cell(path, row, column, header[column], number) for number, row in enumerate(rows, 2)]
        )
        answer.append(10.0 ** (values / 20.0) if unit == "db" else values * units[unit])
    return FrequencyResponse(*map(read_only, answer))


def _column(
    path: Path, header: list[str], name: str, aliases: tuple[str, ...], units: dict[str, float]
) -> tuple[int, str]:
    for index, title in enumerate(header):
        match = re.fullmatch(r"\s*\"?([A-Za-z]+)[^(\[]{0,40}[(\[]\s*([^)\]]{1,10}?)\s*[)\]]\"?\s*", title)
        if match and match[1].lower() in aliases:
            if match[2].lower() not in units:
                raise ValueError(f"{path}: unit `{match[2]}` of {name}: must be one of {', '.join(units)}")
            return index, match[2].lower()
    shown = ", ".join(title.strip()[:40] for title in header[:6])
    raise ValueError(
        f"{path}: no column `{name} ({next(iter(units))})`; the header has {shown}, each must name its unit"
    )


def _cell(path: Path, row: list[str], column: int, title: str, number: int) -> float:
    try:
        value = float(row[column])
    except (IndexError, ValueError):
        shown = row[column][:20] if column < len(row) else "nothing"
        raise ValueError(f"{path}, row {number}, column `{title}`: {shown}: must be a number") from None
    return value
