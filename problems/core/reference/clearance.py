"""Clearance margins of postures, and what comes near: distances less the margins that have to be kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base import FloatArray
from problems.core.interface import Nearby
from problems.core.reference.model import Numbers
from problems.core.reference.postures import Items, Postures, Side, concatenated

LANES = 8  # postures that the compiled core looks at together: what comes near is told in its order


def lower_to_clearance_margins(side: Side, postures: Postures, found: FloatArray, first_hit: bool) -> None:
    """Lower numbers (n,), m, to the margins of postures, or to something in between at first hit."""
    given = found.copy()
    items, margins = side.first(postures, found)
    if not first_hit:
        balls = reached_from(side, postures, items, margins)
        np.minimum.at(found, balls.row, side.margins(postures, balls, np.full(len(balls.row), np.inf)))
    while len(items.row):
        large = side.openings(items) > 0.0
        np.minimum.at(found, items.row[~large], margins[~large])
        enough = np.where(found < given, -np.inf, found) if first_hit else found
        items, margins = side.smaller(postures, items.taken(large & ~(margins >= enough[items.row])), enough)


def reached_from(side: Side, postures: Postures, items: Items, margins: FloatArray) -> Items:
    """The balls to which the nearest item leads in each posture, by descending repeatedly."""
    items = items.taken(_nearest_of_each(items.row, margins))
    while (large := side.openings(items) > 0.0).any():
        parts = side.opened(items.taken(large))
        nearest = _nearest_of_each(parts.row, side.margins(postures, parts, np.full(len(parts.row), np.inf)))
        items = concatenated([items.taken(~large), parts.taken(nearest)])
    return items


def _nearest_of_each(row: Numbers, margins: FloatArray) -> Numbers:
    """The place of the least margin in each posture."""
    order = np.lexsort((margins, row))
    return np.asarray(order[np.diff(row[order], prepend=-1) > 0])


def any_below(side: Side, postures: Postures, given: float) -> bool:
    """Whether a posture has a smaller margin than given; NaN counts as smaller."""
    enough = np.full(postures.count, given)
    items, _ = side.first(postures, enough)
    while len(items.row):
        large = side.openings(items) > 0.0
        if not large.all():
            return True
        items, _ = side.smaller(postures, items, enough)
    return False


def nearest_two(sides: Sequence[Side], postures: Postures, below: float) -> Nearby:
    """The two nearest balls of each two that have to keep a distance, in the compiled core's order."""
    parts = [_two_of(side, postures, below) for side in sides]
    rows, margins, rates, gradients = (np.concatenate(column) for column in zip(*parts, strict=True))
    own = np.repeat([side.kind == 1 for side in sides], [len(part[0]) for part in parts])
    order = np.lexsort((~own, rows // LANES))
    return Nearby(rows[order].astype(np.int32), own[order], margins[order], rates[order], gradients[order])


def _two_of(side: Side, postures: Postures, below: float) -> tuple[Numbers, FloatArray, FloatArray, FloatArray]:
    """Numbers of the postures, margins, rates and gradients of one side."""
    items, margins = _balls(side, postures, below)
    order = np.lexsort((margins, items.row, items.top, items.row // LANES))
    items, margins = items.taken(order), margins[order]
    same = (np.diff(items.row, prepend=-1) == 0) & (np.diff(items.top, prepend=-1) == 0)
    third = same & np.concatenate([[False], same[:-1]])
    items, margins = items.taken(~third), margins[~third]
    out, moving = side.outward(postures, items), postures.moving
    rates = np.zeros(len(margins)) if moving is None else side.rates(items, out, moving.drifts)
    return items.row, margins, rates, _gradients(postures, items, out, side.standing(items))


def _balls(side: Side, postures: Postures, below: float) -> tuple[Items, FloatArray]:
    """All balls with smaller margins than given that may be one of the two nearest, and their margins."""
    enough, parts, found = np.full(postures.count, below), [], []
    second = np.full(len(side.tops[0]) * postures.count, below)  # of each two things in each posture, no less
    items, margins = side.first(postures, enough)
    while True:
        large = side.openings(items) > 0.0
        ends, place = items.taken(~large), items.top * postures.count + items.row
        parts.append(ends)
        found.append(margins[~large])
        if not large.any():
            return concatenated(parts), np.concatenate(found)
        np.minimum.at(
            second, place[large], side.most(postures, items.taken(large), margins[large])
        )  # it holds two at least
        ranked = np.lexsort((found[-1], place[~large]))
        after = np.flatnonzero(np.diff(place[~large][ranked]) == 0) + 1
        np.minimum.at(second, place[~large][ranked[after]], found[-1][ranked[after]])
        items, margins = side.smaller(postures, items.taken(large & (margins <= second[place])), enough)
        kept = np.flatnonzero(margins <= second[items.top * postures.count + items.row])
        items, margins = items.taken(kept), margins[kept]


def _gradients(postures: Postures, items: Items, out: FloatArray, standing: Numbers) -> FloatArray:
    """Derivatives of distances by the joints, (m, dof), m/rad, along the directions outward."""
    model, points = postures.model, postures.centers(items.one, items.row)
    axes = postures.axes[:, :, items.row]
    (x, y, z), (a, b, c) = points[:, None] - postures.frames[:, 3, 1:][:, :, items.row], axes
    turned = (b * z - c * y) * out[0] + (c * x - a * z) * out[1] + (a * y - b * x) * out[2]
    slid = axes[0] * out[0] + axes[1] * out[1] + axes[2] * out[2]
    slopes = np.where(model.joints.turns[:, None], turned, slid)
    joint = np.arange(1, model.dof + 1)[:, None]
    moves = (joint > standing) & (joint <= model.nodes.body[items.one])
    return np.where(moves, slopes, 0.0).T
