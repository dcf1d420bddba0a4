"""A rig's controller for a microcontroller or another simulator, and the microcontroller in the loop."""

from eft._export import export
from eft._firmware import ProcessorInTheLoop

__all__ = ["ProcessorInTheLoop", "export"]
