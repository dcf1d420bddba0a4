"""Wrong input to the command line, the files that it needs, and what the answer must contain."""

from mistakes import comparing, planning, running
from mistakes.given import SWEEP, paper

__all__ = ["SWEEP", "WRONG", "paper"]

# name: (arguments, files to put there first, what the line must contain)
WRONG = running.WRONG | comparing.WRONG | planning.WRONG
