"""The player of motions in space."""

from tpbso_casadi.animation.space.player import page

__all__ = ["page"]
