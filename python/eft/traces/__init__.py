"""Signals of a test in files of other programs, read with their units and written in SI units."""

from eft.traces._compare import Comparison, SignalComparison, compare
from eft.traces._read import read_traces
from eft.traces._traces import Traces
from eft.traces._write import write_run

__all__ = ["Comparison", "SignalComparison", "Traces", "compare", "read_traces", "write_run"]
