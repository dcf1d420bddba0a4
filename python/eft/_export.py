"""A rig's controller for firmware, and rig and controller for other simulators."""

from __future__ import annotations

import io
import zipfile
from functools import lru_cache
from typing import Literal, overload

from eft import _native
from eft._fmu_library import libraries
from eft._native import Rig

__all__ = ["export"]

Part = Literal["rig", "controller"]

_LEVEL = 4
"""Level of compression; the usual 6 takes twice as long and saves a thirtieth."""


@overload
def export(rig: Rig, target: Literal["rust", "c"], name: str | None = None) -> str: ...


@overload
def export(
    rig: Rig, target: Literal["fmu"], name: str | None = None, *, part: Part = "rig", fmi: int = 2
) -> bytes: ...


def export(
    rig: Rig,
    target: Literal["rust", "c", "fmu"],
    name: str | None = None,
    *,
    part: Part = "rig",
    fmi: int = 2,
) -> str | bytes:
    """Return a rig's controller as source text for firmware, or rig or controller as an FMU.

    Parameters
    ----------
    rig : Rig
        The rig; its controller runs at `controller.sample_rate`.
    target : {"rust", "c", "fmu"}
        A constant of `eft-core` in Rust, one for `eft.h` in C, or a functional mock-up unit for
        co-simulation.
    name : str, optional
        The rig's name in the text or in the FMU; by default its own.
    part : {"rig", "controller"}
        Content of the FMU: the virtual rig with its sensors, or the digital controller with learner and
        protection.
    fmi : {2, 3}
        The FMU's version of FMI, 2.0 or 3.0.

    Returns
    -------
    str or bytes
        Source to be compiled, or the bytes of the FMU's file. The parameters are checked here. The compiler
        (Rust), `eft_configure_f32` (C) or the importer checks them again. The source's first comment lists
        the duties of the firmware, such as measuring a pressure or starting the soft end.

    Raises
    ------
    ValueError
        If the name is not an identifier in C. If the rig has a computation delay, because the firmware or the
        importer determines it. If the flow table has more than 21 points for C. The message names the key.

    Examples
    --------
    >>> import eft
    >>> "EFT_RIG" in eft.firmware.export(eft.Rig.zhao2005(), "c")
    True
    """
    if target not in ("rust", "c", "fmu"):
        raise ValueError(f'target = {target}: must be "rust", "c" or "fmu"')
    if target != "fmu":
        return _native.export_source(rig, target, name)
    named = rig if name is None else rig.replace({"name": name})
    description, resource = _native.fmu_files(named, part, fmi)
    binaries = tuple(
        (f"binaries/{library.folders[fmi - 2]}/eft_{part}.{library.ending}", content)
        for library, content in libraries()
    )
    file = io.BytesIO(_archive(binaries))
    with zipfile.ZipFile(file, "a") as fmu:
        _write(fmu, "modelDescription.xml", description.encode())
        _write(fmu, "resources/rig.toml", resource.encode())
    return file.getvalue()


# Compressing a library takes 0.2 s, and every rig has the same ones: by part and version there are four.
@lru_cache(maxsize=4)
def _archive(entries: tuple[tuple[str, bytes], ...]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for path, data in entries:
            _write(archive, path, data)
    return file.getvalue()


def _write(archive: zipfile.ZipFile, path: str, data: bytes) -> None:
    # Without the time of day, so that the same rig gives the same bytes.
    entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))
    archive.writestr(entry, data, zipfile.ZIP_DEFLATED, _LEVEL)
