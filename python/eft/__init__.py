"""Effective force testing: the controller, the virtual rig and the analysis between them.

All quantities are in SI units. Positive force pulls the structure (+x).
"""

from eft._native import (
    Command,
    FlowTable,
    Record,
    Rig,
    __version__,
    effective_force,
    rig_keys,
    sine_sweep,
)

__all__ = [
    "Command",
    "FlowTable",
    "Record",
    "Rig",
    "__version__",
    "effective_force",
    "rig_keys",
    "sine_sweep",
]
