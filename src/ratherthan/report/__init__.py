"""Explanations enter, pages leave: text, picture, numbers and what they rest on in one file that needs no network."""

from ratherthan.report.page import Report, report

__all__ = ["Report", "report"]
