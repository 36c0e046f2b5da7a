"""A system and one row per node enter; what solves their equations leaves: elimination without subtraction, by components."""

from ratherthan.solve.eliminating.factored import Factored

__all__ = ["Factored"]
