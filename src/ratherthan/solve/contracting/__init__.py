"""A task with many states enters that counts costs or rewards; its optimum leaves, swept, or corrected, and proved. No exact solve.

What policy iteration with direct solves does to the last digit on some thousand states would take too long, or too much
memory, on many more. Here values are found by sweeps through windows of layers (`field`), by sweeps of everything where sums are
discounted (`discounting`), or by policy iteration with roughly solved equations where sweeps come to no end (`corrections`), all of them for
costs of any sign, small or large. Then a margin is put around them that the check of `certify` confirms (`proof`). Where the bounds
are not narrow enough the values are refined, and it is tried again. Where no margin is found, or policies may go round and gather
more and more (`growth`), that is found out, or it is given up and the next method has its turn.

**Guarantee.** Bounds are what the checks confirmed on the states as they are; the policy's are confirmed on its own chain, of which the
graph says that it arrives.

**Giving up.** Sweeps: after 400 visits of every node, 100 where one window holds everything, or a pass that gains nothing in the widest
windows. Corrections: after 600 iterations of a Krylov solve, where factors would fill, or after rounds that gain nothing.
"""

from ratherthan.solve.contracting.chains import chain_bounds_at_size
from ratherthan.solve.contracting.contraction import Contracted, contracted, suits_contraction

__all__ = ["Contracted", "chain_bounds_at_size", "contracted", "suits_contraction"]
