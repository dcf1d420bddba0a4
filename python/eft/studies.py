"""Studies: many tests with varied settings, and their results.

`eft.study` runs a study. It is a function, so that this module has the plural's name.
"""

from eft._study import LatinHypercube, Sobol, Study, study

__all__ = ["LatinHypercube", "Sobol", "Study", "study"]
