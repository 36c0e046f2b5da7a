"""With motion certain, the expected distance is the published length of every row of a scenario that is tried."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

import ratherthan as rt
from ratherthan.io.grids.movingai import read_way

MAPS = (
    ("Berlin_0_256.map", "Berlin_0_256.map.scen", 24),
    ("den312d.map", "den312d.map.scen", 60),
    ("maze-32-32-2.map", "maze-32-32-2-random-1.scen", 60),
    ("maze512-8-1.map", "maze512-8-1.map.scen", 12),
    ("random-32-32-20.map", "random-32-32-20-random-1.scen", 60),
    ("room-64-64-8.map", "room-64-64-8-random-1.scen", 60),
    ("warehouse-10-20-10-2-1.map", "warehouse-10-20-10-2-1-random-1.scen", 40),
)
SIX_DIGITS = 5e-6
"""Half a unit in the sixth digit: so many are published in the oldest files."""
CERTAIN = {"slip": 0.0, "stay": 0.0, "directions": 8}


def rows_of(path):
    return sum(1 for line in path.read_text().splitlines() if line.strip()) - 1


def lengths(mdp):
    """The moves as a graph: from state to state, with the length of the move."""
    origin = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
    assert (np.diff(mdp.choice_to_branches) == 1).all()
    length = mdp.rewards["distance"].branch
    return csr_array((length, (origin, mdp.branch_to_target)), shape=(mdp.states, mdp.states))


@pytest.mark.parametrize(("name", "scen", "count"), MAPS)
def test_the_shortest_ways_on_the_models_moves_have_the_published_lengths(shared_data, name, scen, count):
    folder = shared_data / "maps" / "movingai"
    problem = rt.read(folder / name, scen=folder / scen, row=0, **CERTAIN)
    names, graph = problem.mdp.names, lengths(problem.mdp)
    rows = np.unique(np.linspace(0, rows_of(folder / scen) - 1, count).astype(int))
    ways = [read_way(folder / scen, int(row)) for row in rows]
    starts = [names.find("{},{}".format(*way.start)) for way in ways]
    goals = [names.find("{},{}".format(*way.goal)) for way in ways]
    for way, start, goal in zip(ways, starts, goals, strict=True):
        assert dijkstra(graph, indices=start)[goal] == pytest.approx(way.length, rel=SIX_DIGITS)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "scen"), [(name, scen) for name, scen, _ in MAPS if "512" not in name])
def test_the_expected_distance_is_the_published_length(shared_data, name, scen):
    folder = shared_data / "maps" / "movingai"
    for row in (0, rows_of(folder / scen) // 2, rows_of(folder / scen) - 1):
        problem = rt.read(folder / name, scen=folder / scen, row=row, **CERTAIN)
        length = read_way(folder / scen, row).length
        solution = rt.solve(problem)
        start = int(problem.mdp.initial[0])
        slack = SIX_DIGITS * length
        assert solution.lower[0, start] - slack <= length <= solution.upper[0, start] + slack


def test_a_scenario_of_another_map_is_refused(shared_data):
    folder = shared_data / "maps" / "movingai"
    with pytest.raises(
        rt.RatherthanError, match=r"must be for the map it is used on: row 0 is for 'maps/dao/den312d.map'"
    ):
        rt.read(folder / "empty-8-8.map", scen=folder / "den312d.map.scen")
