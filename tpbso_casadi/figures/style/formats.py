"""Kinds of figure files."""

from __future__ import annotations

FORMATS = ("png", "pdf", "svg")
DEFAULT = ("png",)
