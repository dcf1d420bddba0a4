"""An open benchmark of force tracking: rigs that deviate, commands, criteria, and controllers to compare.

The criteria are those of the benchmark problem of real-time hybrid simulation (see `eft.rths`), applied to a
force instead of a displacement. A controller is a class with a method ``step``.
"""

from eft.benchmark._controllers import COMPETITORS, Competitor
from eft.benchmark._excitations import Excitation, excitations
from eft.benchmark._judge import Row
from eft.benchmark._result import Benchmark, Summary
from eft.benchmark._rigs import Case, drawn_cases, named_cases
from eft.benchmark._run import run

__all__ = [
    "COMPETITORS",
    "Benchmark",
    "Case",
    "Competitor",
    "Excitation",
    "Row",
    "Summary",
    "drawn_cases",
    "excitations",
    "named_cases",
    "run",
]
