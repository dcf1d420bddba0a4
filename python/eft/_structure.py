"""The error of an external structure that cannot continue."""

from __future__ import annotations


class StructureError(RuntimeError):
    """An external structure cannot continue, for example because its solution does not converge.

    The structure of `eft.simulate` raises it to end the test as tripped. `TestRun.stopped` has the
    message, one sentence. Any other exception ends the call.
    """
