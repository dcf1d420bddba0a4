"""Wrong input to the command line, the files that it needs, and the required parts of the message."""

from mistakes import comparing, planning, running
from mistakes.given import SWEEP, paper

__all__ = ["SWEEP", "WRONG", "paper"]

# name: (arguments, files to put there first, what the line must contain)
WRONG = running.WRONG | comparing.WRONG | planning.WRONG
