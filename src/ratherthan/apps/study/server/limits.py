"""A name and a moment enter, whether it is too soon leaves: buckets that fill slowly, one for each name."""

from __future__ import annotations

import time
from collections import OrderedDict

from ratherthan.apps.study.server.refusals import RefusedError

__all__ = ["Limit"]

KEPT = 20_000


class Limit:
    """So many requests at once, and so many a second after that.

    Parameters
    ----------
    burst : float
    each_second : float
    """

    def __init__(self, burst: float, each_second: float) -> None:
        self.burst, self.each_second = burst, each_second
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, name: str, cost: float = 1.0) -> None:
        """Count a request under a name.

        Raises
        ------
        RefusedError
            Where there were too many.
        """
        now = time.monotonic()
        left, then = self._left.pop(name, (self.burst, now))
        left = min(self.burst, left + (now - then) * self.each_second)
        enough = left >= cost
        self._left[name] = (left - cost if enough else left, now)
        if len(self._left) > KEPT:
            self._left.popitem(last=False)
        if not enough:
            raise RefusedError(429, "request", "too-many", "Too many requests came from here: wait a minute.")
