"""Comparison of the valves of a catalogue in several tests."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eft._extras import need
from eft._largest_scale import largest_scale
from eft._native import Command, Rig, check_rig
from eft._planning import delay_budget
from eft._sections import Section
from eft._simulate import simulate
from eft._test_file import parse_toml, read_text
from eft.data_sheets import servovalve
from eft.data_sheets._values import Value

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["ValveChoice", "ValveSheet", "ValveTable", "compare_valves", "read_valves"]


@dataclass(frozen=True, eq=False, kw_only=True)
class ValveSheet(Section[str]):
    """A valve of a catalogue; as a mapping, the given arguments of `servovalve`."""

    rated_flow: Value
    """Flow at full opening, m³/s; a text has its own unit, as in the next fields."""
    rated_drop: Value
    """Pressure drop over both lands at that flow, Pa."""
    phase_90_frequency: Value | None = None
    """Where the phase of a small signal is -90°, Hz."""
    damping_ratio: Value | None = None
    """Of the spool."""
    rise_time: Value | None = None
    """From 10 to 90 % of a small step, s."""
    full_step_time: Value | None = None
    """Of a step from 0 to 100 %, s."""
    rated_signal: Value | None = None
    """Command of full opening, V."""
    flow_curve: Sequence[tuple[float, float]] | None = None
    """Opening and share of the flow at full opening, of each point."""
    overlap: Value | None = None
    """Overlap of the lands, a share of the stroke."""

    def __iter__(self) -> Iterator[str]:
        return (name for name in super().__iter__() if getattr(self, name) is not None)


@dataclass(frozen=True)
class ValveChoice:
    """The result of one valve under one command."""

    valve: str
    """Name in the catalogue."""
    command: str
    """Name of the command."""
    grade: str
    """``"go"``, ``"caution"`` or ``"no"``, the grade of the verdict."""
    force_error: float
    """Rms over rms."""
    max_spool: float
    """Largest opening."""
    limited_by: str
    """The first reason against it, or against the next larger factor, or an empty string."""
    largest_scale: float | None = None
    """The largest factor on the command with a usable test, if it was requested."""


@dataclass(frozen=True)
class ValveTable:
    """The results of every valve of a catalogue under every command."""

    rows: tuple[ValveChoice, ...]
    """Valves in the catalogue's order, and within each the commands."""

    def __iter__(self) -> Iterator[ValveChoice]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def suitable(self) -> tuple[str, ...]:
        """Valves with a usable test under every command."""
        names = dict.fromkeys(row.valve for row in self.rows)
        return tuple(
            name for name in names if all(row.grade != "no" for row in self.rows if row.valve == name)
        )

    def _repr_html_(self) -> str:
        from eft import _notebook

        rows = [
            (
                f"{row.valve}, {row.command}",
                f"{row.grade}, force error {row.force_error:.1%}, spool {row.max_spool:.0%}",
            )
            for row in self.rows
        ]
        return _notebook.shown("Valves", [*rows, ("suitable", ", ".join(self.suitable) or "no valve")])

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a data frame (needs pandas).

        Returns
        -------
        pandas.DataFrame
            One row for each valve and command.

        Raises
        ------
        ModuleNotFoundError
            If pandas is not installed.

        Examples
        --------
        >>> import eft
        >>> valve = {"rated_flow": "90 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"}
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 3.0, 2.0, 4096.0)
        >>> table = eft.compare_valves(eft.Rig.zhao2005(), {"sweep": sweep}, {"large": valve})
        >>> table.to_pandas()["valve"].tolist()
        ['large']
        """
        need("pandas")
        import pandas as pd

        return pd.DataFrame([vars(row) for row in self.rows])


def read_valves(path: str | PathLike[str]) -> dict[str, ValveSheet]:
    r"""Read a catalogue of servovalves: tables ``[[valve]]`` with a name and arguments of `servovalve`.

    Parameters
    ----------
    path : path-like
        A TOML file.

    Returns
    -------
    dict
        A `ValveSheet` for each name.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is no catalogue; the message names the valve and the key.

    Examples
    --------
    >>> import tempfile
    >>> import eft
    >>> text = '[[valve]]\nname = "A"\nrated_flow = "15 gpm"\nrated_drop = 7e6\nphase_90_frequency = 100'
    >>> with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
    ...     _ = file.write(text)
    ...     file.flush()
    ...     eft.read_valves(file.name)["A"].rated_flow
    '15 gpm'
    """
    path = Path(path)
    tree = parse_toml(path, read_text(path))
    listed = tree.get("valve")
    if set(tree) != {"valve"} or not isinstance(listed, list) or not listed:
        raise ValueError(f"{path}: must hold tables [[valve]] and nothing else")
    allowed = set(inspect.signature(servovalve).parameters) - {"supply_pressure"}
    found: dict[str, ValveSheet] = {}
    for number, entry in enumerate(listed, 1):
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise ValueError(f"{path}: valve {number}: name must be a string")
        name = entry.pop("name")
        if name in found:
            raise ValueError(f"{path}: valve {number}: name = {name!r} is used twice")
        if unknown := sorted(set(entry) - allowed):
            names = ", ".join(sorted(allowed))
            raise ValueError(f"{path}: valve {name}: unknown key `{unknown[0]}`: must be one of {names}")
        if short := [key for key in ("rated_flow", "rated_drop") if key not in entry]:
            raise ValueError(f"{path}: valve {name}: missing {', '.join(short)}")
        try:
            servovalve(**entry)
        except ValueError as error:
            raise ValueError(f"{path}: valve {name}: {error}") from None
        found[name] = ValveSheet(**entry)
    return found


def compare_valves(
    rig: Rig,
    commands: Mapping[str, Command],
    valves: Mapping[str, Mapping[str, Any]] | str | PathLike[str],
    *,
    largest: bool = False,
) -> ValveTable:
    """Try every valve of a catalogue under every command on the virtual rig.

    Parameters
    ----------
    rig : Rig
        The rig; the valve is replaced, and the response delay is that of `eft.linear.delay_budget`
        without the rig's ``truth``. Nothing of its own valve stays but ``flow_gain_scale``: a key that a
        sheet cannot give, such as ``servovalve.null_bias``, has its default.
    commands : mapping of str to Command
        Commands with names.
    valves : mapping or path-like
        Names with arguments of `servovalve`, or a catalogue as of `eft.read_valves`. The pressure
        is the rig's.
    largest : bool
        Whether to find the largest factor on each command too; about ten times as long.

    Returns
    -------
    ValveTable
        One row for each valve and command.

    Raises
    ------
    OSError
        If the catalogue cannot be read.
    ValueError
        If a valve or a command does not fit the rig.

    Examples
    --------
    >>> import eft
    >>> sheet = {"rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"}
    >>> valves = {"small": {"rated_flow": "2 gpm", **sheet}, "large": {"rated_flow": "90 gpm", **sheet}}
    >>> sweep = eft.sine_sweep(8900.0, 0.5, 3.0, 4.0, 4096.0)
    >>> rig = eft.Rig.zhao2005().replace({"controller.force_loop": "robust", "compensation.adaptive": True})
    >>> eft.compare_valves(rig, {"sweep": sweep}, valves).suitable
    ('large',)
    """
    check_rig(rig)
    catalogue = valves if isinstance(valves, Mapping) else read_valves(valves)
    rows = []
    for name, sheet in catalogue.items():
        fitted = with_valve(rig, sheet)
        rows += [tried(name, title, fitted, command, largest) for title, command in commands.items()]
    return ValveTable(tuple(rows))


def with_valve(rig: Rig, sheet: Mapping[str, Any]) -> Rig:
    """The rig with another valve, at its own pressure.

    Of the old valve only the error of the flow gain stays.
    """
    scale = rig["truth.servovalve.flow_gain_scale"]
    old = {f"servovalve.{name}" for name in rig.to_dict()["servovalve"]} - {"servovalve.flow_gain_scale"}
    keys = servovalve(**({"supply_pressure": rig["supply.pressure"]} | dict(sheet)))
    fitted = rig.replace(dict.fromkeys(("truth.servovalve", "calibration")))
    fitted = fitted.replace(dict.fromkeys(old) | keys | {"truth.servovalve.flow_gain_scale": scale})
    delay = delay_budget(fitted.replace({"truth": None})).path
    return fitted.replace({"compensation.response_delay": delay})


def tried(valve: str, title: str, rig: Rig, command: Command, largest: bool) -> ValveChoice:
    """One test of a rig with a valve of this name."""
    run = simulate(rig, command)
    verdict = run.verdict
    error = float(np.nanmax(run.metrics().nrmse)) if run.success else float("inf")
    reasons, scale = verdict.reasons, None
    if largest:
        found = largest_scale(rig, command, tolerance=0.02)
        scale = found.scale
        reasons = reasons or found.limited_by
    opening = float(np.abs(run.spool).max())
    return ValveChoice(valve, title, verdict.grade, error, opening, reasons[0] if reasons else "", scale)
