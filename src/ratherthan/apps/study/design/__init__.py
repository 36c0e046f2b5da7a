"""A study as a file: read, checked, its stimuli computed once, its screens in a balanced order."""

from ratherthan.apps.study.design.nouns import Card, Design, Option, Record, Screen
from ratherthan.apps.study.design.screens import rounds, screens

__all__ = ["Card", "Design", "Option", "Record", "Screen", "rounds", "screens"]
