"""Few balls that hold a body, proven to hold every triangle; ``cover.hpp`` of the core chooses them.

The space that no flood from outside reaches is filled, so that a body counts as solid whether its mesh is or not. A
ball around a point inside may reach as far beyond the nearest outer triangle as the cover is to overhang; around a
point of the surface, it has just that radius. Of these, each in turn is taken that holds most of the samples of the
surface that no other holds yet. What the proof finds in no ball becomes samples of the next round.
"""

from __future__ import annotations

import logging
import struct
import time
import zlib
from base64 import b64decode, b64encode
from dataclasses import astuple, dataclass
from hashlib import sha256

import numpy as np

from problems.base import FloatArray, InvalidProblem, cache, cached_text
from problems.geometry.proof import Balls
from problems.library import needed_core

LOG = logging.getLogger(__name__)
VERSION = "3"  # of how covers are made: another finds none of those kept before
MOST_STORED_BALLS = 200_000  # in a stored text
QUANTUM = 2.0**-17  # m: places and radii are whole multiples, so that what is stored is what was proven
LARGEST_COORDINATE = 1_000.0  # m, for which the rounding of proofs is derived


@dataclass(frozen=True, kw_only=True)
class CoverSettings:
    """Settings of the choice of the balls of a cover.

    Values are chosen for meshes of robots. The share of aligned neighbours was measured on five arms: with 0.8, covers
    have 10 % more balls, with 0.95 1 % fewer in half as much time again. With 12 million voxels, fine covers of an ABB
    IRB 2400 have 4 % fewer balls in 1.6 times the time; with one million, 60 % more, which stick out farther.

    Attributes:
        quantum: of which places and radii are whole multiples, m.
        usual_voxel: side of a voxel, m; the overhang where that is less.
        voxel_share: the side as a share of the overhang, where that is more.
        most_voxels: voxels of a lattice; of a larger body they are larger.
        aligned_share: share of the distance to a neighbour: where depth grows by more, the neighbour's ball is
            better.
        thinning: share of the radius of the cap that a ball covers of a plane, by which candidates of a size
            are apart.
        sample_depth: share of the overhang by which samples lie inside a ball that holds them.
        coarseness: share of the overhang: size of pieces of a triangle that the proof does not cut for samples.
        most_rounds: rounds of choice and proof.
        most_balls: balls of a cover.
        directions: directions in which the overhang of a ball is measured.
    """

    quantum: float = QUANTUM
    usual_voxel: float = 0.0025
    voxel_share: float = 0.125
    most_voxels: float = 2e6
    aligned_share: float = 0.9
    thinning: float = 0.2
    sample_depth: float = 0.1
    coarseness: float = 0.5
    most_rounds: float = 20
    most_balls: float = 10_000
    directions: float = 48


SETTINGS = CoverSettings()


@dataclass(frozen=True)
class Cover:
    """Balls that hold a body, and how far they stick out of it.

    Attributes:
        balls: of the cover.
        usual_overhang: 95 % of its surface are no farther from the body, m.
        largest_overhang: nor any of it that was looked at, m.
        volume_ratio: of its volume to the body's.
    """

    balls: Balls
    usual_overhang: float
    largest_overhang: float
    volume_ratio: float

    @property
    def text(self) -> str:
        """The cover in letters and digits, to be stored."""
        figures = struct.pack("<3d", self.usual_overhang, self.largest_overhang, self.volume_ratio)
        numbers = np.column_stack([self.balls.centers, self.balls.radii]) / QUANTUM
        return b64encode(figures + zlib.compress(numbers.astype("<i4").T.tobytes(), 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> Cover:
        """The cover that a text states.

        Raises:
            InvalidProblem: ``cover`` is none.
        """
        try:
            content = b64decode(text.encode(), validate=True)
            unpacker = zlib.decompressobj()
            numbers = unpacker.decompress(content[24:], 16 * MOST_STORED_BALLS)
            columns = np.frombuffer(numbers, "<i4").reshape(4, -1).astype(np.float64) * QUANTUM
            figures = struct.unpack("<3d", content[:24])
        except (ValueError, struct.error, zlib.error) as error:
            raise InvalidProblem("cover", f"it is none: {error}") from error
        if not unpacker.eof or not columns.size or not (columns[3] > 0.0).all() or not np.isfinite(figures).all():
            raise InvalidProblem("cover", "it is none, or not whole")
        return cls(Balls(columns[:3].T.copy(), columns[3].copy()), *figures)


def cover_of(corners: FloatArray, overhang: float) -> Cover:
    """A cover of triangles, proven to hold all of them; made once, and cached on disk.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        overhang: how far a ball may reach beyond the triangles, m; farther where more balls were needed than a cover
            may have, as for large sheets.

    Raises:
        InvalidProblem: ``mesh`` is far from its origin, or its cover cannot be proven.
        NoCore: there is no compiled core.
    """
    made_of = sha256(np.ascontiguousarray(corners, dtype="<f8").tobytes()).hexdigest()
    key = cache.key_of("cover", VERSION, made_of, repr(float(overhang)))
    return Cover.from_text(cached_text(key, "cover", lambda: _new_text(corners, overhang)))


def _new_text(corners: FloatArray, overhang: float) -> str:
    began = time.perf_counter()
    cover = new_cover_of(corners, overhang)
    figures = len(corners), len(cover.balls), 1e3 * overhang, time.perf_counter() - began
    LOG.info("cover: %d triangles, %d spheres that stick out by %.3g mm, %.1f s", *figures)
    return cover.text


def new_cover_of(corners: FloatArray, overhang: float) -> Cover:
    """A cover of triangles, proven to hold all of them.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        overhang: how far a ball may reach beyond the triangles, m.

    Raises:
        InvalidProblem: ``mesh`` is far from its origin, or its cover cannot be proven.
        NoCore: there is no compiled core.
    """
    triangles, settings = np.ascontiguousarray(corners, dtype=np.float64), np.array(astuple(SETTINGS), dtype=float)
    if np.abs(triangles).max() > LARGEST_COORDINATE:
        raise InvalidProblem("mesh", f"it is more than {LARGEST_COORDINATE:g} m from the origin of its link")
    balls, figures = np.empty((int(SETTINGS.most_balls), 4)), np.empty(3)
    count = needed_core().core_cover(
        len(triangles), triangles.ctypes.data, overhang, settings.ctypes.data, balls.ctypes.data, figures.ctypes.data
    )
    if count == 0:
        return new_cover_of(corners, 1.5 * overhang)
    if count < 0:
        reason = f"no cover was proven in {SETTINGS.most_rounds:g} rounds" if count == -1 else "memory does not suffice"
        raise InvalidProblem("mesh", reason)
    usual, largest, ratio = figures.tolist()
    return Cover(Balls(balls[:count, :3].copy(), balls[:count, 3].copy()), usual, largest, ratio)
