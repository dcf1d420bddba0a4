"""From data sheets to the keys of a rig.

Every function takes numbers in SI units or texts with a unit, and returns keys for `Rig.replace`. The theory
pages have the formulas and their sources.
"""

from eft.data_sheets._hydraulics import actuator, supply
from eft.data_sheets._rig import QUESTIONS, TEMPLATE, Question, missing, rig
from eft.data_sheets._structure import stories, structure
from eft.data_sheets._valve import servovalve

__all__ = [
    "QUESTIONS",
    "TEMPLATE",
    "Question",
    "actuator",
    "missing",
    "rig",
    "servovalve",
    "stories",
    "structure",
    "supply",
]
