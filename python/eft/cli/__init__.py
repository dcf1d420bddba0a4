"""The command line `eft`."""

from eft.cli._main import main

__all__ = ["main"]
