"""Angles and whole turns."""

from __future__ import annotations

from math import pi

import casadi as ca

from problems.base.matrix import Matrix


def wrap_to(angle: Matrix, reference: Matrix) -> Matrix:
    """``angle`` plus whole turns, within (reference - pi, reference + pi]; elementwise, rad."""
    return angle - 2.0 * pi * ca.ceil((angle - reference - pi) / (2.0 * pi))
