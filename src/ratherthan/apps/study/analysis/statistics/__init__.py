"""Numbers enter as arrays, test statistics with their sizes and intervals leave; what cannot be computed is said.

====================  =============================================================================================
module                holds
====================  =============================================================================================
`variance`            the one-way analysis of variance, Tukey's comparisons, Welch's test: every number counts alone
`repeated`            the analysis of variance of a table of persons by kinds, and paired or unpaired contrasts
`ranks`               Friedman, Kendall's W, Kruskal-Wallis, Mann-Whitney, Wilcoxon: only order counts
`mixed`               a linear mixed model by restricted maximum likelihood: persons may lack answers
`choosing`            shares of choices, tests of them, and a ranking by Luce's model
`corrections`         Holm's correction, and intervals by resampling persons
====================  =============================================================================================

Whatever lacks the data it needs raises `NotComputableError` with a sentence that says what is missing.
"""

from __future__ import annotations

from ratherthan.errors import RatherthanError

__all__ = ["NotComputableError"]


class NotComputableError(RatherthanError):
    """A statistic cannot be computed from these data; the message says why."""
