"""The report of a test: one HTML file that needs nothing beside it."""

from eft.report._page import write_report

__all__ = ["write_report"]
