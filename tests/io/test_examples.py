"""The examples, checked by plain loops over dictionaries that share nothing with the package's solver and factors."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.errors import ModelError, PropertyError, SourceError
from ratherthan.io._state_table import parse_state_table
from ratherthan.io.examples import example_names, read_example
from ratherthan.model.objective import ExpectedCost, ReachAvoid

CITIES = ("city-1", "city-2", "city-3")


class Plain:
    """Least expected costs, critical states and ε of a model, by the definitions."""

    def __init__(self, name: str, goal: str, reward: str) -> None:
        self.problem = read_example(name)
        mdp = self.mdp = self.problem.mdp
        self.goal = {s for s in range(mdp.states) if mdp.labels[goal][s]}
        paid = mdp.rewards[reward].choice
        self.rows: dict[int, dict[str, tuple[float, dict[int, float]]]] = {
            s: {
                mdp.action_name(c): (
                    float(paid[c]),
                    dict(
                        zip(
                            mdp.branch_to_target[mdp.branches_of(c)].tolist(),
                            mdp.branch_to_probability[mdp.branches_of(c)].tolist(),
                            strict=True,
                        )
                    ),
                )
                for c in mdp.choices_of(s)
            }
            for s in range(mdp.states)
        }
        sure = self.sure()
        self.rho = {s: (1e4 if s in sure else math.inf) for s in self.rows} | dict.fromkeys(self.goal, 0.0)
        for _ in range(20_000):
            new = {
                s: min(self.q(s, a) for a in self.rows[s]) if s not in self.goal and s in sure else self.rho[s]
                for s in self.rows
            }
            if all(abs(new[s] - self.rho[s]) < 1e-13 for s in sure):
                break
            self.rho = new
        self.critical = {s for s in self.rows if s not in self.goal and self.spread(s) > 1e-9}

    def sure(self) -> set[int]:
        """Return the states from which some policy is sure to arrive."""
        inside = set(self.rows)
        while True:
            reached = set(self.goal)
            grown = True
            while grown:
                grown = False
                for s in inside - reached:
                    if any(set(to) <= inside and set(to) & reached for _, to in self.rows[s].values()):
                        reached.add(s)
                        grown = True
            if reached == inside:
                return inside
            inside = reached

    def omega(self, s: int, a: str) -> float:
        return sum(chance * self.rho[t] for t, chance in self.rows[s][a][1].items())

    def q(self, s: int, a: str) -> float:
        return self.rows[s][a][0] + self.omega(s, a)

    def spread(self, s: int) -> float:
        values = [self.q(s, a) for a in self.rows[s]]
        return 0.0 if max(values) == min(values) else max(values) - min(values)

    def tree(self, s: int, a: str) -> set[int]:
        seen: set[int] = set()
        todo = [t for t in self.rows[s][a][1] if t != s]
        while todo:
            u = todo.pop()
            if u not in seen:
                seen.add(u)
                todo += [] if u in self.goal else [t for _, to in self.rows[u].values() for t in to if t != s]
        return seen

    def epsilon(self, s: int, a: str) -> int:
        return sum(len(self.rows[u]) for u in self.tree(s, a) & self.critical)

    def ahead(self, s: int, a: str) -> int:
        """Return where an action leads if it succeeds."""
        return max(self.rows[s][a][1].items(), key=lambda branch: branch[1])[0]

    def route(self) -> list[tuple[int, str]]:
        s, found = int(self.mdp.initial[0]), []
        while s not in self.goal:
            a = min(self.rows[s], key=lambda a: round(self.q(s, a), 9))
            found.append((s, a))
            s = self.ahead(s, a)
        return found


@pytest.fixture(scope="module")
def paper() -> Plain:
    return Plain("paper-5x5", "destination", "distance")


def test_the_names_are_those_of_the_files():
    assert example_names() == ("city-1", "city-2", "city-3", "delivery", "office", "paper-5x5", "pedestrians")


@pytest.mark.parametrize("name", example_names())
def test_every_example_says_what_it_wants_and_is_solved(name):
    problem = read_example(name)
    assert problem.source == f"example:{name}"
    assert problem.objective is not None
    solution = rt.solve(problem)
    start = int(problem.mdp.initial[0])
    assert 0 < solution.values[0, start] < math.inf
    assert rt.narrate(rt.explain(solution)).startswith("First, we ")


@pytest.mark.parametrize(
    ("name", "goal", "reward"),
    [
        *((name, "destination", reward) for name in CITIES for reward in ("distance", "time")),
        *((name, "destination", reward) for name in ("office", "pedestrians") for reward in ("distance", "risk")),
        *(("delivery", "delivered", reward) for reward in ("energy", "time")),
        ("paper-5x5", "destination", "distance"),
    ],
)
def test_the_package_agrees_with_plain_loops(name, goal, reward):
    plain = Plain(name, goal, reward)
    solution = rt.solve(plain.problem, ExpectedCost(goal=f'"{goal}"', reward=reward))
    assert solution.values[0] == pytest.approx(np.array([plain.rho[s] for s in range(plain.mdp.states)]), rel=1e-8)


def test_an_unknown_example_is_refused_with_a_list():
    with pytest.raises(SourceError, match=r"city-1, .*, pedestrians; got 'paper-5x6'\. Did you mean 'paper-5x5'\?"):
        read_example("paper-5x6")
    with pytest.raises(SourceError, match="must be one of"):
        read_example("../roadmap")


# ---- the paper's map


def test_the_papers_map_has_its_size_and_says_what_it_is(paper):
    mdp, world = paper.mdp, paper.problem.world
    assert (mdp.states, mdp.choices, mdp.branches) == (25, 31, 56)
    assert world.note == "reconstruction"
    assert list(mdp.labels) == ["destination"]
    assert list(mdp.rewards) == ["distance"]
    assert mdp.initial.tolist() == [5]
    assert paper.goal == {4}
    assert paper.problem.objective == ExpectedCost(goal='"destination"', reward="distance")
    kinds = {
        "building": {1, 18},
        "dead end": {0, 2, 13},
        "highway": {15, 20, 21, 22, 23, 24, 19, 14, 9},
        "start": {5},
        "destination": {4},
        "urban road": {3, 6, 7, 8, 10, 11, 12, 16, 17},
    }
    for kind, cells in kinds.items():
        assert set(np.flatnonzero(world.kind_of_cell == world.kinds.index(kind)).tolist()) == cells


def test_the_papers_moves_come_in_their_order_and_succeed_with_nine_tenths(paper):
    expected = {s: ["stay"] for s in (0, 1, 2, 4, 13, 18)}
    expected |= {
        5: ["south", "north"],
        10: ["east", "south"],
        11: ["east", "north"],
        6: ["east"],
        12: ["north", "south"],
    }
    expected |= {17: ["west"], 16: ["north"], 7: ["east", "north"], 8: ["north"], 3: ["east"], 15: ["south"]}
    expected |= {20: ["east"], 21: ["east"], 22: ["east"], 23: ["east"], 24: ["north"], 19: ["north"]}
    expected |= {14: ["north", "west"], 9: ["north"]}
    step = {"north": -5, "east": 1, "south": 5, "west": -1, "stay": 0}
    assert {s: list(own) for s, own in paper.rows.items()} == expected
    for s, own in paper.rows.items():
        for action, (cost, to) in own.items():
            assert cost == (0 if s == 4 else 1)
            assert to == ({s: 1.0} if action == "stay" else {s + step[action]: 0.9, s: 0.1})


def test_the_papers_numbers_come_out(paper):
    values = {10: Fraction(20, 3), 11: Fraction(50, 9), 15: 10}
    assert {s: paper.rho[s] for s in values} == pytest.approx({s: float(v) for s, v in values.items()}, abs=1e-9)
    assert [round(paper.omega(10, a), 3) for a in ("east", "south")] == [5.667, 9.667]
    assert [round(paper.q(10, a), 3) for a in ("east", "south")] == [6.667, 10.667]
    assert paper.critical == {5, 7, 10, 12, 14}
    counts = {(10, "south"): 2, (10, "east"): 4, (5, "south"): 8, (12, "north"): 2, (12, "south"): 2, (7, "east"): 0}
    assert {key: paper.epsilon(*key) for key in counts} == counts
    assert paper.tree(10, "south") & paper.critical == {14}
    least = min(paper.q(10, a) for a in ("east", "south"))
    assert [round(paper.q(10, a) - least, 9) for a in ("south", "east")] == [4, 0]
    infinite = {(5, "north"), (7, "north"), (14, "west")}
    dead = {0, 1, 2, 13, 18}
    assert {
        (s, a) for s in paper.rows for a in paper.rows[s] if math.isinf(paper.q(s, a)) and s not in dead
    } == infinite


def test_the_paper_has_three_routes(paper):
    def routes(s: int, visited: tuple[int, ...]) -> list[int]:
        if s in paper.goal:
            return [len(visited)]
        ahead = (paper.ahead(s, a) for a in paper.rows[s])
        return [length for t in ahead if t not in (*visited, s) for length in routes(t, (*visited, s))]

    assert sorted(routes(5, ())) == [7, 7, 11]


# ---- the towns


@pytest.mark.parametrize("name", CITIES)
def test_the_towns_are_alike_and_tell_the_factors_apart(name):
    town = Plain(name, "destination", "distance")
    world = town.problem.world
    assert (world.width, world.height) == (10, 10)
    present = {world.kinds[kind] for kind in world.kind_of_cell}
    assert present == {"start", "destination", "building", "dead end", "urban road", "highway"}
    route = town.route()
    assert len(route) == 16
    told = [(s, a) for s, a in route if s in town.critical]
    assert len(told) == 6
    found = set()
    for s, a in told:
        best = [b for b in town.rows[s] if town.q(s, b) <= town.q(s, a) + 1e-9]
        assert best == [a]
        counts = {b: town.epsilon(s, b) for b in town.rows[s]}
        others = [count for b, count in counts.items() if b != a]
        found.add("both" if counts[a] > max(others) else "same" if set(others) == {counts[a]} else "best only")
    assert found == {"both", "same", "best only"}
    reachable = {int(town.mdp.initial[0])}.union(*(town.tree(*step) for step in [route[0]]))
    assert (reachable & town.critical) - {s for s, _ in route}


def test_in_every_town_the_fastest_route_is_another():
    for name in CITIES:
        assert Plain(name, "destination", "time").route() != Plain(name, "destination", "distance").route()


# ---- the office


def test_in_the_office_short_and_quiet_are_two_things():
    short, quiet = Plain("office", "destination", "distance"), Plain("office", "destination", "risk")
    crowd = set(np.flatnonzero(short.mdp.labels["crowd"]).tolist())
    ways = {s for s, _ in short.route()}, {s for s, _ in quiet.route()}
    assert ways[0] & crowd
    assert not ways[1] & crowd
    assert len(ways[0]) < len(ways[1])
    assert set(short.problem.properties) == {"safest", "least-risk"}
    assert short.problem.properties["least-risk"] == ExpectedCost(goal='"destination"', reward="risk")


def test_in_the_office_the_safest_way_is_not_quite_safe():
    problem = read_example("office")
    safest = problem.properties["safest"]
    assert isinstance(safest, ReachAvoid)
    solution = rt.solve(problem, safest)
    # One cell of the way has people at one side: 0.9 ahead against a drift of 0.02 to them decide it.
    assert solution.values[0, 26] == pytest.approx(0.9 / 0.92, rel=1e-9)


# ---- the way past the market


def ways(problem: rt.Problem, wish: str | ExpectedCost) -> list[int]:
    """Return the cells of the route that is explained."""
    objective = problem.properties[wish] if isinstance(wish, str) else wish
    solution = rt.solve(problem, objective)
    mdp, at, route = problem.mdp, int(problem.mdp.initial[0]), []
    while not mdp.labels["destination"][at]:
        route.append(at)
        branches = mdp.branches_of(int(solution.policy.choice[at]))
        at = int(mdp.branch_to_target[branches][mdp.branch_to_probability[branches].argmax()])
    return route


SHORT = [24, 25, 26, 27, 28, 29, 30]
BETWEEN = [24, 25, 33, 41, 42, 43, 44, 45, 46, 38, 30]
SAFE = [24, 16, 8, 0, 1, 2, 3, 4, 5, 6, 7, 15, 23]


def test_past_the_market_there_are_three_routes():
    problem = read_example("pedestrians")
    assert ways(problem, "shortest") == SHORT
    assert ways(problem, "between") == BETWEEN
    assert ways(problem, "safest") == SAFE
    crowd = set(np.flatnonzero(problem.mdp.labels["crowd"]).tolist())
    crossings = set(np.flatnonzero(problem.mdp.labels["crossing"]).tolist())
    assert [(len(crowd & {*route}), len(crossings & {*route})) for route in (SHORT, BETWEEN, SAFE)] == [
        (4, 0),
        (0, 2),
        (0, 0),
    ]


def test_the_three_routes_have_the_values_worked_by_hand():
    problem = read_example("pedestrians")
    # Each move takes 1 / 0.8 attempts; an attempt to leave a cell of the market meets 0.4 people, at a crossing 0.08.
    by_hand = {"shortest": (7 / 0.8, 4 * 0.4 / 0.8), "between": (11 / 0.8, 2 * 0.08 / 0.8), "safest": (13 / 0.8, 0.0)}
    for wish, values in by_hand.items():
        policy = rt.solve(problem, problem.properties[wish]).policy
        for reward, value in zip(("distance", "risk"), values, strict=True):
            found = rt.evaluate(problem, policy, ExpectedCost(goal='"destination"', reward=reward))
            assert found.policy_values[0, 24] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("weight", "route"),
    [(0.1, SHORT), (2.7, SHORT), (2.8, BETWEEN), (10, BETWEEN), (12.4, BETWEEN), (12.6, SAFE), (1000, SAFE)],
)
def test_a_weighted_sum_of_distance_and_risk_picks_each_of_the_routes_for_a_range_of_weights(weight, route):
    # 5 more distance for 1.8 less risk is worth it from W = 25/9 on, 2.5 more for 0.2 less from W = 12.5 on.
    wish = ExpectedCost(goal='"destination"', reward=f"distance + {weight} * risk")
    assert ways(read_example("pedestrians"), wish) == route


def test_the_three_routes_are_explained_in_words_of_their_own():
    problem = read_example("pedestrians")
    said = {
        name: rt.narrate(rt.explain(rt.solve(replace(problem, objective=wish))))
        for name, wish in problem.properties.items()
    }
    assert said["shortest"].startswith("First, we move east at critical grid 24 because it leads to the shortest")
    assert (
        "we move south at critical grid 25 because it leads to the best route between short and safe" in said["between"]
    )
    assert said["safest"].startswith("First, we move north at critical grid 24 because it leads to the safest route.")


# ---- the delivery


def test_the_delivery_has_what_maps_lack():
    energy = Plain("delivery", "delivered", "energy")
    assert energy.problem.world is None
    assert 10 <= energy.mdp.states <= 30
    names = energy.mdp.names
    assert names[1] == "place=depot, battery=2, parcel=aboard"
    assert names.find("place=stairs") == 12
    # Worked by hand: door 1 + 0.05 · 1, lift 1 + 1.05; across the lawn d = 2 + 0.75 · 2.05 + 0.25 · (1 + d).
    depot = (2 + 0.75 * 2.05 + 0.25) / 0.75
    assert energy.rho[1] == pytest.approx(depot)
    assert energy.rho[0] == pytest.approx(1 / 0.95 + depot)
    # Impact and action value disagree at the depot.
    assert energy.omega(1, "street") < energy.omega(1, "lawn")
    assert energy.q(1, "lawn") < energy.q(1, "street")
    # Waiting costs no energy, and the stairs may fail for ever.
    assert energy.rows[4]["wait"][0] == 0
    assert energy.q(4, "stairs") == math.inf
    assert energy.rho[12] == math.inf
    assert energy.problem.lexicon.actions["pick_up"] == "pick up the parcel"


STATES = """
variables = ["place", "level"]
start = "a 1"
property = 'R{"cost"}min=? [F "home"]'
[labels]
home = { place = "b" }
[[state]]
is = "a 1"
go = { cost = 2, to = "0.5 b 1, 0.5 a 1" }
[[state]]
is = "b 1"
rest = { to = "b 1" }
"""


def test_a_table_of_states_is_read():
    problem = parse_state_table(STATES, source="table")
    assert (problem.mdp.states, problem.mdp.choices, problem.mdp.branches) == (2, 2, 3)
    assert problem.mdp.names[0] == "place=a, level=1"
    assert rt.solve(problem).values[0].tolist() == pytest.approx([4, 0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("variables =", "varables =", "Did you mean 'variables'?"),
        ('start = "a 1"', "", "must have 'start'"),
        ('start = "a 1"', 'start = "c 1"', "'c 1' is not"),
        ('is = "b 1"', 'is = "b"', "one value per variable"),
        ('is = "b 1"', 'is = "a 1"', "got 'a 1' twice"),
        ('is = "b 1"', "", "must say what it is"),
        ('rest = { to = "b 1" }', "", "'b 1' has none"),
        ('rest = { to = "b 1" }', "rest = 1", "must say where it leads"),
        ("0.5 a 1", "half a 1", "a probability and a state, got 'half a 1'"),
        ("0.5 a 1", "0.5 a 2", "'a 2' is not. Did you mean 'a 1'?"),
        ("cost = 2", "cost = -2", "0 or more, got -2"),
        ('place = "b"', 'plaec = "b"', "Did you mean 'place'?"),
        ('home = { place = "b" }', "home = 3", "which values its states have"),
        ("min=?", "min<=3", "best value"),
    ],
)
def test_a_wrong_table_of_states_is_refused(old, new, message):
    assert old in STATES
    with pytest.raises(SourceError) as caught:
        parse_state_table(STATES.replace(old, new), source="table")
    assert message in caught.value.message


def test_wrong_numbers_and_properties_of_a_table_are_refused():
    with pytest.raises(ModelError, match=r"must sum to 1, got 0\.9"):
        parse_state_table(STATES.replace("0.5 a 1", "0.4 a 1"), source="table")
    with pytest.raises(PropertyError):
        parse_state_table(STATES.replace('"cost"', '"cots"'), source="table")
