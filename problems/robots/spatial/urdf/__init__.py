"""Robots from URDF text, read with ``xml.etree`` alone."""

from problems.robots.spatial.urdf.reader import read_urdf

__all__ = ["read_urdf"]
