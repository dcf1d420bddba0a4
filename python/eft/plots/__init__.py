"""Figures of a test. Each function draws on given axes (`ax=`) and returns them, without global styles.

Functions that end in a number lay out a whole page like that figure of the paper. They return the matplotlib
figure, ready for `savefig`.
"""

from eft._signals import Response
from eft.plots.histories import (
    SPOOL_ADVICE,
    displacement_history,
    force_history,
    spool_history,
    velocity_history,
)
from eft.plots.loops import hysteresis
from eft.plots.models import force_loop, identification, linear_model
from eft.plots.overview import command, record, run_page, study
from eft.plots.paper import figure_8, figure_8_ratio, figure_9, figure_10, figure_11, figure_structure
from eft.plots.paper_planning import figure_4, figure_6, figure_maps
from eft.plots.planning import flow_curve, force_loop_gains, inverse_dynamics, response_delay, stability_map
from eft.plots.spectra import drive_response, force_ratio, force_spectrum

__all__ = [
    "SPOOL_ADVICE",
    "Response",
    "command",
    "displacement_history",
    "drive_response",
    "figure_4",
    "figure_6",
    "figure_8",
    "figure_8_ratio",
    "figure_9",
    "figure_10",
    "figure_11",
    "figure_maps",
    "figure_structure",
    "flow_curve",
    "force_history",
    "force_loop",
    "force_loop_gains",
    "force_ratio",
    "force_spectrum",
    "hysteresis",
    "identification",
    "inverse_dynamics",
    "linear_model",
    "record",
    "response_delay",
    "run_page",
    "spool_history",
    "stability_map",
    "study",
    "velocity_history",
]
