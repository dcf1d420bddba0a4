"""The command line `eft`: the package without Python."""

from eft.cli._main import main

__all__ = ["main"]
