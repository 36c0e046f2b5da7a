"""A graph and a root enter, the numbers of its dominator tree leave: loops that can be left and taken up again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["depth_first", "semidominators", "tree_places"]

Numbers = npt.NDArray[np.int32]
Offsets = npt.NDArray[np.int64]


def depth_first(
    leaving_from: Offsets,
    leaving: Numbers,
    room: tuple[Numbers, Numbers, Numbers, Numbers, Offsets],
    at: Offsets,
    budget: int,
) -> bool:
    """Number the states depth first, from those on the path.

    `room` is the number of each state (-1 where it has none), the states and their parents by number, the path, and where each
    state goes on; `at` is how many are numbered and the place on the path. Returns whether it is done within `budget` edges.
    """
    number, vertex, parent, path, onward = room
    found, depth = at
    while depth >= 0 and budget > 0:
        budget -= 1
        s = path[depth]
        i = onward[s]
        if i == leaving_from[s + 1]:
            depth -= 1
            continue
        onward[s] = i + 1
        t = leaving[i]
        if number[t] < 0:
            number[t] = found
            vertex[found] = t
            parent[found] = number[s]
            found += 1
            depth += 1
            path[depth] = t
    at[0], at[1] = found, depth
    done: bool = depth < 0
    return done


def semidominators(
    entering_from: Offsets,
    entering: Numbers,
    numbering: tuple[Numbers, Numbers, Numbers],
    room: tuple[Numbers, Numbers, Numbers],
    last: int,
    budget: int,
) -> int:
    """Find the semidominators of the states numbered `last` and below, from large numbers to small.

    `numbering` is number, vertex and parent; `room` is the semidominator by number, an ancestor with the least semidominator on the
    way to it, the parent and the number itself at first, and a path. Returns the last number that is left after about `budget`
    edges.
    """
    number, vertex, parent = numbering
    semi, link, path = room  # both parts of a link lie in one line of the cache
    w = last
    while w > 0 and budget > 0:
        least = parent[w]
        v = vertex[w]
        budget -= entering_from[v + 1] - entering_from[v] + 1
        for i in range(entering_from[v], entering_from[v + 1]):
            u = number[entering[i]]
            if u < 0:
                continue
            if u > w:  # linked already: the least semidominator on the way up, with compression
                depth = 0
                x = u
                while link[x, 0] > w:
                    path[depth] = x
                    depth += 1
                    x = link[x, 0]
                while depth > 0:
                    depth -= 1
                    y = x
                    x = path[depth]
                    link[x, 0] = link[y, 0]
                    link[x, 1] = min(link[x, 1], link[y, 1])
                u = link[u, 1]
            least = min(least, u)
        semi[w] = link[w, 1] = least
        w -= 1
    return w


def tree_places(states: int, vertex: Numbers, parent: Numbers, semi: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return the position of every state in preorder of the dominator tree, the size of its subtree, and the order."""
    found = len(semi)
    idom = parent[:found].copy()
    size = np.ones(found, np.int32)
    for w in range(1, found):
        x = idom[w]
        while x > semi[w]:
            x = idom[x]
        idom[w] = x
    for k in range(1, found):
        w = found - k
        size[idom[w]] += size[w]
    free = np.ones(found, np.int32)  # the next free position in each subtree
    place = np.zeros(found, np.int32)
    position = np.full(states, -1, np.int32)
    extent = np.zeros(states, np.int32)
    order = np.zeros(found, np.int32)
    for w in range(found):
        if w > 0:
            place[w] = free[idom[w]]
            free[idom[w]] += size[w]
            free[w] = place[w] + 1
        s = vertex[w]
        position[s] = place[w]
        extent[s] = size[w]
        order[place[w]] = s
    return position, extent, order
