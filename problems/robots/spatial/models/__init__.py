"""Robots that are built in: their files, and the catalogue of them."""

from problems.robots.spatial.models.catalogue import MODELS, built_in

__all__ = ["MODELS", "built_in"]
