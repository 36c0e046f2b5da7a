"""How fast discounted sums of gains and losses are maximised, against quantecon and mdpsolver."""

from __future__ import annotations

from functools import partial

from benchmarks.harness import Case
from benchmarks.models import gambles
from benchmarks.peers import by_mdpsolver, by_quantecon, by_us

SIZES = ((5_000, 0.99), (100_000, 0.99), (100_000, 0.999))
FEW = 5_000
"""Up to how many states a peer that takes lists is asked."""


def cases() -> list[Case]:
    found = []
    for states, discount in SIZES:
        model, name = partial(gambles, states, discount=discount), f"{states:,} states, discount {discount}"
        found += [
            Case(name="ratherthan", run=by_us(model), group=name, peer=True),
            Case(name="quantecon, modified policy iteration", run=by_quantecon(model), group=name),
        ]
        if states <= FEW:
            found.append(Case(name="mdpsolver, modified policy iteration", run=by_mdpsolver(model), group=name))
    return found
