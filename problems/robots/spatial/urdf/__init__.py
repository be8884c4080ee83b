"""Robots from URDF text, read with ``xml.etree`` alone."""

from problems.robots.spatial.urdf.reader import read_urdf
from problems.robots.spatial.urdf.srdf import read_srdf

__all__ = ["read_srdf", "read_urdf"]
