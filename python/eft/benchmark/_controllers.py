"""The controllers of the benchmark: settings of the rig's own, external classes, and their names."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from eft._native import Rig
from eft._simulate import StepController
from eft.benchmark import _peers

GROUP = "eft.controllers"
"""Group of the entry points by which other packages register a class under a name."""

Maker = Callable[..., StepController]


@dataclass(frozen=True)
class Competitor:
    """A controller of the benchmark."""

    name: str
    """Its name in arguments."""
    title: str
    """Its description."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Changed keys of the rig's own controller, or of the rig that an external controller gets."""
    make: Maker | None = None
    """Makes an external controller as ``make(rig, sample_rate=...)``; None for the rig's own."""
    repeats: int = 0
    """Repeats of `eft.iterate` on the same rig before the judged test."""
    instructions: int | None = None
    """Budget of its tick on a Cortex-M4F, without velocity estimate and protection; None if unknown."""


_DIGITAL: dict[str, object] = {"controller.realization": "digital"}
_FEEDFORWARD: dict[str, object] = {"compensation.feedforward": True, "compensation.look_ahead": True}
_ADAPTIVE = _FEEDFORWARD | {"compensation.adaptive": True, "compensation.curve_correction": False}
_CURVE: dict[str, object] = _ADAPTIVE | {"compensation.curve_correction": True}
_ROBUST: dict[str, object] = {"controller.force_loop": "robust"}
_COMPLIANCE: dict[str, object] = {"actuator.attachment_stiffness": 1.4e6, "sensors.motion_at": "structure"}
"""A spring between actuator and specimen, N/m; the sensors are at the specimen."""


_INSTRUCTIONS = {"nonlinear": 170, "analog": 170, "adaptive": 216, "curve": 230, "robust-adaptive": 243}
"""Budgets of the controllers whose tick is measured, from firmware/budgets.toml."""


def _table() -> dict[str, Competitor]:
    own: dict[str, tuple[str, dict[str, object]]] = {
        "pd": ("PD alone", {"compensation.mode": "off"}),
        "linear": ("linear velocity compensation", {"compensation.mode": "linear"}),
        "nonlinear": ("nonlinear velocity compensation, the paper", {}),
        "analog": ("the same, force loop in continuous time", {"controller.realization": "analog"}),
    }
    peers: dict[str, tuple[str, Maker]] = {
        "ats": ("adaptive time series around the paper", _peers.AdaptiveTimeSeries),
        "loop-shaping": ("loop shaping alone", _peers.LoopShaping),
        "loop-shaping-fixed": ("loop shaping, compensation", _peers.CompensatedLoopShaping),
        "loop-shaping-adaptive": ("loop shaping, adaptive with curve", _peers.AdaptiveLoopShaping),
    }
    spring = "added compliance: a spring, eft designed loop"
    ours: dict[str, tuple[str, dict[str, object]]] = {
        "fixed": ("eft fixed, with feedforward", _FEEDFORWARD),
        "adaptive": ("eft adaptive", _ADAPTIVE),
        "curve": ("eft adaptive with curve", _CURVE),
        "robust": ("eft designed loop", _ROBUST | _FEEDFORWARD),
        "robust-adaptive": ("eft designed loop, adaptive", _ROBUST | _ADAPTIVE),
        "robust-curve": ("eft designed loop, adaptive with curve", _ROBUST | _CURVE),
    }
    competitors = _of_the_core(own)
    competitors += [Competitor(name, title, _DIGITAL, make) for name, (title, make) in peers.items()]
    repeated = "the paper, five repeats of drive iteration"
    competitors.append(Competitor("iteration", repeated, _DIGITAL, repeats=5))
    competitors.append(Competitor("compliance", spring, _DIGITAL | _FEEDFORWARD | _ROBUST | _COMPLIANCE))
    competitors += _of_the_core(ours)
    return {one.name: one for one in competitors}


def _of_the_core(schemes: Mapping[str, tuple[str, dict[str, object]]]) -> list[Competitor]:
    return [
        Competitor(name, title, _DIGITAL | keys, instructions=_INSTRUCTIONS.get(name))
        for name, (title, keys) in schemes.items()
    ]


COMPETITORS = _table()
"""The controllers that ship with the benchmark, by name."""


def find(asked: str | Competitor | Maker) -> Competitor:
    """Find a competitor by name, by entry point, as ``package:Class``, or from a class."""
    if isinstance(asked, Competitor):
        return asked
    if not isinstance(asked, str):
        name = getattr(asked, "__name__", type(asked).__name__)
        return _outside(name, asked)
    if asked in COMPETITORS:
        return COMPETITORS[asked]
    module, colon, name = asked.partition(":")
    if not colon:
        from importlib import metadata  # not needed otherwise, and slow to load

        for entry in metadata.entry_points(group=GROUP, name=asked):
            return _outside(asked, _loaded(asked, entry.load))
        names = ", ".join(COMPETITORS)
        raise ValueError(
            f"controller = {asked!r}: must be package:Class, an entry point of {GROUP}, or one of {names}"
        )

    def load() -> object:
        found: object = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
        return found

    return _outside(asked, _loaded(asked, load))


def _loaded(asked: str, load: Callable[[], object]) -> object:
    try:
        return load()
    except Exception as error:
        # The import of an external module may raise any exception.
        raise ValueError(f"controller = {asked!r}: cannot be imported: {told(error)}") from None


def _outside(name: str, make: object) -> Competitor:
    if not callable(make):
        raise ValueError(
            f"controller = {name!r}: must be a class that is made as Class(rig, sample_rate=...), "
            f"not of type {type(make).__name__}"
        )
    return Competitor(name, name, _DIGITAL, make)


def field_of(competitors: Iterable[str | Competitor | Maker] | None) -> tuple[Competitor, ...]:
    """Return the requested competitors, each once; without a request all that ship."""
    if isinstance(competitors, str) or not isinstance(competitors, Iterable | None):
        told = getattr(competitors, "__name__", competitors)
        raise ValueError(f"controllers = {told!r}: must be a list of names or classes")
    asked = COMPETITORS.values() if competitors is None else [find(one) for one in competitors]
    if not asked:
        raise ValueError("controllers = none: must be at least one")
    named: dict[str, Competitor] = {}
    for one in asked:
        if named.setdefault(one.name, one) != one:
            raise ValueError(
                f"controller = {one.name!r}: two controllers have this name, and it is that of their rows"
            )
    return tuple(named.values())


def made(competitor: Competitor, rig: Rig, sample_rate: float) -> StepController:
    """Make a controller from the rig without its truth."""
    assert competitor.make is not None
    controller = competitor.make(rig.replace({"truth": None}), sample_rate=sample_rate)
    if not callable(getattr(controller, "step", None)):
        raise ValueError(f"controller = {competitor.name!r}: must have a method step")
    return controller


def told(error: BaseException) -> str:
    """An exception in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
