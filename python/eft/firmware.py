"""A rig's controller for a microcontroller, and the microcontroller in the loop."""

from eft._firmware import ProcessorInTheLoop
from eft._native import export

__all__ = ["ProcessorInTheLoop", "export"]
