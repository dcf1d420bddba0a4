"""The report of a test or a study: one HTML file that needs no other file."""

from eft.report._page import write_report
from eft.report._study import write_study_report

__all__ = ["write_report", "write_study_report"]
