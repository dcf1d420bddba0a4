"""Studies: the selection of their tests, their execution and the storage of their rows."""

from eft._study._driver import study
from eft._study._result import Study
from eft._study._samplers import LatinHypercube, Sobol

__all__ = ["LatinHypercube", "Sobol", "Study", "study"]
