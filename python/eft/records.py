"""Ground motions: reading, preparation and spectra.

The methods of a `Record` return new records, so they can be chained::

    eft.read_record(path).baseline_corrected().band_passed(0.1, 25.0)
"""

from eft._native import Record, displacement_spectrum, effective_force, read_record

__all__ = ["Record", "displacement_spectrum", "effective_force", "read_record"]
