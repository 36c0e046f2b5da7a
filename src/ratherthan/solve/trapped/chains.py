"""The system of one policy enters, whose bounds could not be proved otherwise; bounds of its values leave, by plateaus.

With one row per node the largest value is also the least, so a chain that lingers for very long is bounded from above as a largest
value is, and from below as a least one (`proof`), each on plateaus of its own direction.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.system import System
from ratherthan.solve.trapped.exact import is_exact
from ratherthan.solve.trapped.proof import bound_on_plateaus
from ratherthan.solve.trapped.traps import improved_in_two_parts

__all__ = ["chain_past_traps"]


def chain_past_traps(system: System) -> tuple[Floats | None, Floats | None] | None:
    """Return a lower and an upper bound of the values of a chain, ``[n]``, each None if it is not proved; None if nothing is found.

    Parameters
    ----------
    system : System
        With one row per node; a sink can be reached from every node.
    """
    if not is_exact(system):
        return None
    equations = Factored(system)
    if not equations.follow(np.arange(system.nodes)):
        return None
    found = improved_in_two_parts(system, maximise=True, equations=equations, most=1)
    if found is None:
        return None
    own = np.arange(system.nodes)
    lower, upper = (bound_on_plateaus((system, system), own, found, maximise) for maximise in (False, True))
    return lower, upper
