"""Robots that are built in: their files, and the catalogue of them."""

from problems.robots.spatial.models.catalogue import BUILT_IN, built_in

__all__ = ["BUILT_IN", "built_in"]
