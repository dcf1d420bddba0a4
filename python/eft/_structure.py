"""Structures from outside: what they raise when they cannot go on."""

from __future__ import annotations


class StructureError(RuntimeError):
    """A structure from outside cannot go on, as when its solution does not converge.

    Raised by the structure of `eft.simulate`, it ends the test there, tripped; `TestRun.stopped` has the
    message, one sentence. Any other exception ends the call.
    """
