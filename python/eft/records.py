"""Ground motions: reading them, preparing them, their spectra.

A `Record` has what prepares it as methods, so that they chain::

    eft.read_record(path).baseline_corrected().band_passed(0.1, 25.0)
"""

from eft._native import Record, displacement_spectrum, effective_force, read_record

__all__ = ["Record", "displacement_spectrum", "effective_force", "read_record"]
