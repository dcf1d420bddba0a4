"""Processes that tests start and interrupt."""

import os
import time
from pathlib import Path


def wait_until_busy(process, seconds):
    """Wait until a process has used this processor time, because a busy machine delays it."""
    wait_for(lambda: _worked(process) >= seconds)


def wait_for(condition):
    """Wait until a condition holds, 100 s at the most."""
    deadline = time.monotonic() + 100
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)


def _worked(process):
    fields = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
