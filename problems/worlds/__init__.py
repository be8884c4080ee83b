"""A robot and its surroundings: one set of questions, answered by the compiled core or by formulas of pairs."""

from problems.core import World
from problems.worlds.choice import world_of
from problems.worlds.pair_world import PairWorld

__all__ = ["PairWorld", "World", "world_of"]
