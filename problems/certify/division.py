"""Into which cells of time, and balls around balls, the proof of a certificate is divided.

The bounds are those of the checker, which does not trust what is found here: it computes each of them again, and
whether cells and balls hold everything.
"""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.certify.check_certificate import Cells, Certificate, Motion, RefusedError, Scene, Whole

INITIAL_CELLS = 48
MOST_ITEMS = 5_000_000  # bounds that are computed

CELL = [("piece", np.intp), ("start", np.float64), ("end", np.float64)]
ITEM = np.dtype([("one", np.intp), ("other", np.intp), ("cell", CELL)])  # a ball, what it keeps clear of, and when
Items = np.ndarray[Any, np.dtype[np.void]]


def divided(content: dict[str, Any]) -> dict[str, Any]:
    """The proof of a certificate.

    Args:
        content: of the certificate, of which the proof does not count.

    Raises:
        RefusedError: none was found; the message names the claim.
    """
    certificate = Certificate({**content, "proof": {"cells": [], "obstacles": [], "own": [], "torque": []}})
    certificate.check_motion()
    found = {key: _settled(certificate, key == "own") for key in ("obstacles", "own")}
    cells, numbers = np.unique(np.concatenate([items["cell"] for items in found.values()]), return_inverse=True)
    count = len(found["obstacles"])
    return {
        "cells": [list(cell) for cell in cells.tolist()],
        "obstacles": _listed(found["obstacles"], numbers[:count]),
        "own": _listed(found["own"], numbers[count:]),
        "torque": [list(cell) for cell in np.sort(_torque_cells(certificate)).tolist()],
    }


def _listed(items: Items, numbers: NDArray[np.intp]) -> list[list[Any]]:
    """Each pair with the numbers of its cells."""
    rows = sorted(zip(items["one"].tolist(), items["other"].tolist(), numbers.tolist(), strict=True))
    return [[*pair, [cell for _, _, cell in group]] for pair, group in groupby(rows, lambda row: row[:2])]


def cells_over(motion: Motion, at_least: int) -> Items:
    """At least so many cells, equally long in each piece."""
    counts = np.maximum(1, np.ceil(at_least * motion.lengths / motion.breaks[-1]).astype(np.intp))
    edges = [np.linspace(0.0, length, count + 1) for length, count in zip(motion.lengths, counts, strict=True)]
    cells = np.empty(int(counts.sum()), dtype=CELL)
    cells["piece"] = np.repeat(np.arange(motion.pieces), counts)
    cells["start"] = np.concatenate([each[:-1] for each in edges])
    cells["end"] = np.concatenate([each[1:] for each in edges])
    return cells


def halved(cells: Items) -> Items:
    """The first halves, then the second ones."""
    middles = cells["start"] + (cells["end"] - cells["start"]) / 2.0
    both = np.tile(cells, 2)
    both["end"][: len(cells)], both["start"][len(cells) :] = middles, middles
    return both


def _settled(certificate: Certificate, own: bool) -> Items:
    """Pairs that have room all through a cell, all together everything: divided where one has not."""
    roots = np.array(certificate.roots(own), dtype=np.intp).reshape(-1, 2)
    cells = cells_over(certificate.motion, INITIAL_CELLS)
    items = np.empty(len(roots) * len(cells), dtype=ITEM)
    items["one"], items["other"] = np.repeat(roots, len(cells), axis=0).T
    items["cell"] = np.tile(cells, len(roots))
    done, count = [items[:0]], 0
    while len(items):
        count += len(items)
        spare, travel, number, scene = _rooms(certificate, items, own)
        settled, size = spare >= 0.0, _sizes(certificate, items, own)
        hopeless = ~settled & (size == 0.0) & ~(spare + travel >= 0.0)
        if hopeless.any() or count > MOST_ITEMS:
            k = int(np.argmax(hopeless | (~hopeless.any() & ~settled)))
            where = certificate.described(int(items["one"][k]), int(items["other"][k]), own)
            raise RefusedError(f"no proof of the clearance of {where}, {scene.cells.during(int(number[k]))}")
        done.append(items[settled])
        large = ~settled & (size > travel)
        small = items[~settled & ~large]
        cut = np.tile(small, 2)
        cut["cell"] = halved(small["cell"])
        items = np.concatenate([_parts(certificate, items[large], own), cut])
    return np.concatenate(done)


INITIAL_TORQUE_CELLS = 24
MOST_TORQUE_CELLS = 50_000


def _torque_cells(certificate: Certificate) -> Items:
    """Cells in which torques are within their limits; none where they are not limited."""
    cells = cells_over(certificate.motion, INITIAL_TORQUE_CELLS)[: None if certificate.robot.has_torques else 0]
    done = [cells[:0]]
    while len(cells):
        among = Cells(certificate.motion, cells["piece"], cells["start"], cells["end"])
        wrong = certificate.exceeding(among)
        left = wrong.any(axis=1)
        done.append(cells[~left])
        cells = halved(cells[left])
        if sum(map(len, done)) + len(cells) > MOST_TORQUE_CELLS:
            k, joint = np.argwhere(wrong)[0]
            raise RefusedError(f"no proof of the torque of {certificate.robot.joints[joint]}, {among.during(int(k))}")
    return np.concatenate(done)


def _rooms(certificate: Certificate, items: Items, own: bool) -> tuple[FloatArray, FloatArray, NDArray[np.intp], Scene]:
    """What the checker finds: what is left of the room of each, how far it travels; the number of its cell."""
    cells, number = np.unique(items["cell"], return_inverse=True)
    among = Cells(certificate.motion, cells["piece"], cells["start"], cells["end"])
    scene = Scene(certificate.robot, certificate.obstacles, among)
    spare, travel = scene.spare(items["one"], items["other"], number, own)
    return spare, travel, number, scene


def _sizes(certificate: Certificate, items: Items, own: bool) -> FloatArray:
    """The larger radius of what can be divided; 0 of balls of the cover."""
    robot = certificate.robot
    radii = np.where(robot.counts > 0, robot.radii, 0.0)
    return np.asarray(np.maximum(radii[items["one"]], radii[items["other"]] if own else 0.0))


def _parts(certificate: Certificate, items: Items, own: bool) -> Items:
    """Each divided as the checker does it."""
    pairs = zip(items["one"].tolist(), items["other"].tolist(), strict=True)
    parts = [certificate.robot.parts(*pair, own) for pair in pairs]
    found = np.repeat(items, [len(each) for each in parts])
    flat: Whole = np.array([pair for each in parts for pair in each], dtype=np.intp).reshape(-1, 2)
    found["one"], found["other"] = flat.T
    return found
