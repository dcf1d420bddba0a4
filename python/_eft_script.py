"""The script `eft`, apart from the package: an interrupt while that loads must leave no traceback."""

import os
import signal
import sys
from types import FrameType


def main() -> int:
    """Load the package and run its command line; returns the exit code."""
    # A process without standard error has None there, on which a progress bar fails.
    sys.stderr = sys.stderr or os.fdopen(os.open(os.devnull, os.O_WRONLY), "w")
    # A job in a shell's background ignores interrupts, and goes on doing so.
    heeded = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if heeded:
        signal.signal(signal.SIGINT, _leave)
    from eft.cli import main as command_line

    if heeded:
        signal.signal(signal.SIGINT, _interrupt)
    code = command_line()
    if heeded:
        # The interpreter would give the signal its default action while it ends, and lose the exit code.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return code


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    """End the command with what is done; one more ends the process, and finds no handler half done."""
    signal.signal(signal.SIGINT, _leave)
    raise KeyboardInterrupt


def _leave(_signal: int, _frame: FrameType | None) -> None:
    """End at once: an exception would pass through half a module, or through what handles the first."""
    os.write(sys.stderr.fileno(), b"eft: interrupted\n")
    os._exit(130)
