"""Many tests at once: which ones, how they are run, where their rows go."""

from eft._study._driver import study
from eft._study._result import Study
from eft._study._samplers import LatinHypercube, Sobol

__all__ = ["LatinHypercube", "Sobol", "Study", "study"]
