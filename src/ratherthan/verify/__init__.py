"""A stored explanation and a model enter; for each claim leaves whether it holds, does not hold, or cannot be decided.

This room re-computes everything by its own means: of the rest it knows the nouns of the model, the form of an explanation and
its words, nothing of solvers, factors and claims.
"""

from ratherthan.verify.candidates import Budget
from ratherthan.verify.recheck import verify
from ratherthan.verify.verdict import Check, Verdict, Verdicts

__all__ = ["Budget", "Check", "Verdict", "Verdicts", "verify"]
