"""Paths of the tool traced in least time, in the plane and in space."""

from problems.families.traced.problem import space_tracing, tracing

__all__ = ["space_tracing", "tracing"]
