"""The three factors: selectiveness, constrictiveness, responsibility; each holds its definition and its citation."""

from ratherthan.factors.compare import TOLERANCE, Comparison, Interval, compare
from ratherthan.factors.constrictiveness import (
    Constrictiveness,
    Counts,
    Effort,
    Nearer,
    Search,
    constrictiveness,
    count_decisions,
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
    "Counts",
    "Criticality",
    "Effort",
    "Interval",
    "Nearer",
    "Responsibility",
    "Search",
    "compare",
    "compared_at",
    "constrictiveness",
    "count_decisions",
    "critical_states",
    "critical_states_of_levels",
    "nearer_goal",
    "responsibility",
    "search_tree",
]
