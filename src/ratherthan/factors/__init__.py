"""The three factors: selectiveness, constrictiveness, responsibility; each holds its definition and its citation."""

from ratherthan.factors.compare import TOLERANCE, Comparison, Interval, compare
from ratherthan.factors.constrictiveness import (
    Constrictiveness,
    Nearer,
    Search,
    constrictiveness,
    nearer_goal,
    search_tree,
)
from ratherthan.factors.responsibility import Responsibility, responsibility
from ratherthan.factors.selectiveness import Criticality, critical_states

__all__ = [
    "TOLERANCE",
    "Comparison",
    "Constrictiveness",
    "Criticality",
    "Interval",
    "Nearer",
    "Responsibility",
    "Search",
    "compare",
    "constrictiveness",
    "critical_states",
    "nearer_goal",
    "responsibility",
    "search_tree",
]
