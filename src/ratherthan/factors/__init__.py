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
from ratherthan.factors.levels import Compared, compared_at, critical_states_of_levels
from ratherthan.factors.responsibility import Responsibility, responsibility
from ratherthan.factors.selectiveness import Criticality, critical_states

__all__ = [
    "TOLERANCE",
    "Compared",
    "Comparison",
    "Constrictiveness",
    "Criticality",
    "Interval",
    "Nearer",
    "Responsibility",
    "Search",
    "compare",
    "compared_at",
    "constrictiveness",
    "critical_states",
    "critical_states_of_levels",
    "nearer_goal",
    "responsibility",
    "search_tree",
]
