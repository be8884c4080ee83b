"""How much room postures have, and what comes near: the least distance that is kept, less what has to be kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base import FloatArray
from problems.core.interface import Nearby
from problems.core.reference.model import Numbers
from problems.core.reference.postures import Items, Postures, Side, joined

LANES = 8  # postures that the compiled core looks at together: what comes near is told in its order


def lower_to_rooms(side: Side, postures: Postures, found: FloatArray, first_hit: bool) -> None:
    """Replace what is more than the room of each posture, (n,), m, by that, or by something in between at first hit."""
    given = found.copy()
    items, rooms = side.first(postures, found)
    if not first_hit:
        balls = reached_from(side, postures, items, rooms)
        np.minimum.at(found, balls.row, side.rooms(postures, balls, np.full(len(balls.row), np.inf)))
    while len(items.row):
        large = side.openings(items) > 0.0
        np.minimum.at(found, items.row[~large], rooms[~large])
        enough = np.where(found < given, -np.inf, found) if first_hit else found
        items, rooms = side.smaller(postures, items.taken(large & ~(rooms >= enough[items.row])), enough)


def reached_from(side: Side, postures: Postures, items: Items, rooms: FloatArray) -> Items:
    """Of each posture the balls to which the item that comes nearest leads, again and again."""
    items = items.taken(_nearest_of_each(items.row, rooms))
    while (large := side.openings(items) > 0.0).any():
        parts = side.opened(items.taken(large))
        nearest = _nearest_of_each(parts.row, side.rooms(postures, parts, np.full(len(parts.row), np.inf)))
        items = joined([items.taken(~large), parts.taken(nearest)])
    return items


def _nearest_of_each(row: Numbers, rooms: FloatArray) -> Numbers:
    """Where in each posture is the least."""
    order = np.lexsort((rooms, row))
    return np.asarray(order[np.diff(row[order], prepend=-1) > 0])


def any_below(side: Side, postures: Postures, given: float) -> bool:
    """Whether a posture has less room; what is no number is less."""
    enough = np.full(postures.count, given)
    items, _ = side.first(postures, enough)
    while len(items.row):
        large = side.openings(items) > 0.0
        if not large.all():
            return True
        items, _ = side.smaller(postures, items, enough)
    return False


def nearest_two(sides: Sequence[Side], postures: Postures, below: float) -> Nearby:
    """Of each two that have to keep a distance the two balls that come nearest, in the compiled core's order."""
    parts = [_two_of(side, postures, below) for side in sides]
    rows, rooms, rates, gradients = (np.concatenate(column) for column in zip(*parts, strict=True))
    own = np.repeat([side.kind == 1 for side in sides], [len(part[0]) for part in parts])
    order = np.lexsort((~own, rows // LANES))
    return Nearby(rows[order].astype(np.int32), own[order], rooms[order], rates[order], gradients[order])


def _two_of(side: Side, postures: Postures, below: float) -> tuple[Numbers, FloatArray, FloatArray, FloatArray]:
    """Of one side: numbers of the postures, rooms, rates and gradients."""
    items, rooms = _balls(side, postures, below)
    order = np.lexsort((rooms, items.row, items.top, items.row // LANES))
    items, rooms = items.taken(order), rooms[order]
    same = (np.diff(items.row, prepend=-1) == 0) & (np.diff(items.top, prepend=-1) == 0)
    third = same & np.concatenate([[False], same[:-1]])
    items, rooms = items.taken(~third), rooms[~third]
    out, moving = side.ways_out(postures, items), postures.moving
    rates = np.zeros(len(rooms)) if moving is None else side.rates(items, out, moving.drifts)
    return items.row, rooms, rates, _gradients(postures, items, out, side.standing(items))


def _balls(side: Side, postures: Postures, below: float) -> tuple[Items, FloatArray]:
    """All balls that have less room than is given and may be one of two that come nearest, and how much."""
    enough, parts, found = np.full(postures.count, below), [], []
    second = np.full(len(side.tops[0]) * postures.count, below)  # of each two things in each posture, no less
    items, rooms = side.first(postures, enough)
    while True:
        large = side.openings(items) > 0.0
        ends, place = items.taken(~large), items.top * postures.count + items.row
        parts.append(ends)
        found.append(rooms[~large])
        if not large.any():
            return joined(parts), np.concatenate(found)
        np.minimum.at(
            second, place[large], side.most(postures, items.taken(large), rooms[large])
        )  # it holds two at least
        ranked = np.lexsort((found[-1], place[~large]))
        after = np.flatnonzero(np.diff(place[~large][ranked]) == 0) + 1
        np.minimum.at(second, place[~large][ranked[after]], found[-1][ranked[after]])
        items, rooms = side.smaller(postures, items.taken(large & (rooms <= second[place])), enough)
        kept = np.flatnonzero(rooms <= second[items.top * postures.count + items.row])
        items, rooms = items.taken(kept), rooms[kept]


def _gradients(postures: Postures, items: Items, out: FloatArray, standing: Numbers) -> FloatArray:
    """Along the way out of what is nearest each joint moves the centre of the ball: by the joints, (m, dof), m/rad."""
    model, points = postures.model, postures.centers(items.one, items.row)
    axes = postures.axes[:, :, items.row]
    (x, y, z), (a, b, c) = points[:, None] - postures.frames[:, 3, 1:][:, :, items.row], axes
    turned = (b * z - c * y) * out[0] + (c * x - a * z) * out[1] + (a * y - b * x) * out[2]
    slid = axes[0] * out[0] + axes[1] * out[1] + axes[2] * out[2]
    slopes = np.where(model.joints.turns[:, None], turned, slid)
    joint = np.arange(1, model.dof + 1)[:, None]
    moves = (joint > standing) & (joint <= model.nodes.body[items.one])
    return np.where(moves, slopes, 0.0).T
