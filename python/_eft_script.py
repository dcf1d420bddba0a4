"""The script `eft`, apart from the package: an interrupt while that loads must leave no traceback."""

import os
import signal
import sys
from types import FrameType


def main() -> int:
    """Load the package and run its command line; returns the exit code."""
    # A job in a shell's background ignores interrupts, and goes on doing so.
    heeded = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if heeded:
        signal.signal(signal.SIGINT, _leave)
    from eft.cli import main as command_line

    if heeded:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return command_line()


def _leave(_signal: int, _frame: FrameType | None) -> None:
    """End at once: nothing is begun yet, and an exception would pass through half a module."""
    os.write(sys.stderr.fileno(), b"eft: interrupted\n")
    os._exit(130)
