"""Firmware in the loop: an emulated processor runs the controller, and this program runs the plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike

from eft import _native
from eft._native import Command, Rig
from eft._run import TestRun
from eft._simulate import Structure

__all__ = ["ProcessorInTheLoop"]


@dataclass(frozen=True)
class ProcessorInTheLoop:
    """A firmware image under QEMU that replaces the rig's controller in a test.

    The image reads the sensors, and writes its valve commands and estimates, as the images in `firmware/` do.
    It must be built with the controller of the same rig, including velocity estimate and protection (see
    `export`). QEMU (``qemu-system-arm``) must be installed.

    Parameters
    ----------
    image : str or os.PathLike
        The firmware, as an ELF file.
    machine : str
        QEMU's name of the processor: "mps2-an386" is a Cortex-M4F, "mps2-an500" a Cortex-M7.
    """

    image: str | PathLike[str]
    machine: str = "mps2-an386"

    def simulate(
        self,
        rig: Rig,
        command: Command,
        *,
        structure: Structure | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> TestRun:
        """Run a test with the firmware as the controller.

        The plant and the sensors are those of `eft.simulate`. Firmware with the rig's controller gives the
        bits of ``eft.simulate(rig, command, dtype="f32")``. With self-calibration the found flows stay in the
        firmware, and `TestRun.found_flows` is None.

        Parameters
        ----------
        rig : Rig
            The rig; its `controller.realization` must be "digital".
        command : Command
            The force to be applied, sampled at the firmware's rate.
        structure : callable, optional
            Replaces the rig's structure, as in `eft.simulate`.
        progress : callable, optional
            Called a few times a second with the samples done and their total; an exception from it ends the
            run.

        Returns
        -------
        TestRun

        Raises
        ------
        ValueError
            If the rig's controller is analog, or has a computation delay or a soft end. The message names the
            key.
        OSError
            If the image or QEMU is missing.

        Examples
        --------
        >>> import eft
        >>> rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 4096.0)
        >>> processor = eft.firmware.ProcessorInTheLoop("firmware.elf")
        >>> run = processor.simulate(rig, sweep)  # doctest: +SKIP
        """
        outside = {} if structure is None else {"structure": structure}
        outcome = _native.processor_in_the_loop(rig, command, self.image, self.machine, progress, **outside)
        return TestRun._of(rig, command, "f32", outcome, structure is not None)
