"""The command line `eft`: the package without a line of Python."""

from eft.cli._main import main

__all__ = ["main"]
