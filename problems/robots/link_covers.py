"""Covers of links: few balls for searches, many for proofs, made from what a description states and files hold."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.base import FloatArray, InvalidProblem
from problems.geometry import Balls, Cover, cover_of, read_mesh
from problems.robots.shapes import NO_TRIANGLES, MeshShape, Shape
from problems.robots.spheres import Ball
from problems.robots.transform import as_point


@dataclass(frozen=True, kw_only=True)
class LinkCoverSettings:
    """Settings of the covers of links.

    Values are chosen.

    Attributes:
        coarse_overhang: overhang, m, of the balls for searches.
        coarse_share: the same as a share of the reach, where that is less.
        fine_overhang: overhang, m, of the balls for proofs.
        usual_size: m: of a larger link that a joint moves, overhangs are larger in proportion, and so is the arm.
        standing_size: the same of what no joint moves, as mobile bases are large.
    """

    coarse_overhang: float = 0.02
    coarse_share: float = 0.03
    fine_overhang: float = 0.002
    usual_size: float = 1.0
    standing_size: float = 0.2


SETTINGS = LinkCoverSettings()


ReadFile = Callable[[MeshShape], bytes]


@dataclass(frozen=True)
class LinkCover:
    """Balls that are proven to hold a link's collision geometry, in the link's frame.

    Attributes:
        link: its name.
        overhang: of the coarse balls, m.
        coarse: those that hold its meshes; None where it has none.
        fine: those that hold its meshes, boxes and cylinders; None where it has none.
    """

    link: str
    overhang: float
    coarse: Cover | None
    fine: Cover | None

    @property
    def searched(self) -> tuple[Ball, ...]:
        """The coarse balls, for searches."""
        if self.coarse is None:
            return ()
        each = zip(self.coarse.balls.centers, self.coarse.balls.radii.tolist(), strict=True)
        return tuple(Ball(as_point(center), radius, max(radius - self.overhang, 0.0)) for center, radius in each)


@dataclass(frozen=True)
class MeshNote:
    """A remark on a mesh.

    Attributes:
        link: that has it.
        file: as it is named.
        note: what is unusual.
    """

    link: str
    file: str
    note: str


def cover_link(
    link: str,
    shapes: Sequence[Shape],
    read: ReadFile,
    overhang: float,
    fine_overhang: float = SETTINGS.fine_overhang,
    stands: bool = False,
) -> tuple[LinkCover, list[MeshNote]]:
    """The covers of a link, and notes on its meshes.

    Args:
        link: its name.
        shapes: of its collision geometry.
        read: the content of a mesh's file.
        overhang: of the coarse balls, m; more of a large link.
        fine_overhang: of the fine balls, m; more of a large link.
        stands: whether no joint moves it, so that a smaller link counts as large.

    Raises:
        InvalidProblem: ``urdf`` names a mesh that cannot be read or covered, with the reason in one line.
    """
    meshes, notes = [], []
    files = [shape.mesh for shape in shapes if shape.mesh is not None]
    for file in files:
        with _named(link, file.file):
            mesh = read_mesh(file.file, read(file), file.scale)
        meshes.append(file.placed(mesh.corners))
        notes += [MeshNote(link, file.file, note) for note in (*mesh.reading, *mesh.flaws)]
    triangles = [*meshes, *(shape.placed(shape.triangles) for shape in shapes if len(shape.triangles))]
    with _named(link, ", ".join(file.file for file in files)):
        body, exact = (np.concatenate([NO_TRIANGLES, *parts]) for parts in (meshes, triangles))
        overhang = _overhang(body, overhang, stands) if meshes else overhang
        coarse = cover_of(body, overhang) if meshes else None
        fine = cover_of(exact, _overhang(exact, fine_overhang, stands)) if triangles else None
    return LinkCover(link, overhang, coarse, fine), notes


def _overhang(triangles: FloatArray, usual: float, stands: bool) -> float:
    size = float(np.linalg.norm(np.ptp(triangles, axis=(0, 1))))
    return usual * max(1.0, size / (SETTINGS.standing_size if stands else SETTINGS.usual_size))


@contextmanager
def _named(link: str, files: str) -> Iterator[None]:
    try:
        yield
    except InvalidProblem as error:
        what = f"its mesh {files}" if files else "its shapes"
        raise InvalidProblem("urdf", f"link {link!r}: {what}: {error.reason}; {advice(link)}") from error


def advice(link: str) -> str:
    """The advice for a link whose geometry is not known."""
    return f"state spheres for it, or leave it out of every verdict: ignore_geometry = [{link!r}]"


def searched_balls(shapes: Iterable[Shape], cover: LinkCover | None) -> tuple[Ball, ...]:
    """The balls of a link for searches, in its frame: those of its shapes, and those that hold its meshes."""
    stated = (ball.seen_from(shape.pose) for shape in shapes for ball in shape.balls())
    return (*stated, *(() if cover is None else cover.searched))


def fine_balls(shapes: Iterable[Shape], cover: LinkCover | None) -> Balls:
    """The balls of a link for proofs, in its frame: those of its cover, and of shapes of which balls say all."""
    stated = _stated(shapes, cover)
    balls = Balls(
        np.array([b.center for b in stated]).reshape(-1, 3), np.array([b.radius for b in stated], dtype=float)
    )
    return balls if cover is None or cover.fine is None else cover.fine.balls.combined(balls)


def _stated(shapes: Iterable[Shape], cover: LinkCover | None) -> list[Ball]:
    """Balls of shapes that are not in the cover, by formulas."""
    return [
        ball.seen_from(shape.pose)
        for shape in shapes
        if shape.mesh is None and not (cover is not None and len(shape.triangles))
        for ball in shape.balls(SETTINGS.fine_overhang)
    ]


def overhang_of(shapes: Iterable[Shape], cover: LinkCover | None) -> float:
    """The distance by which balls of a link for proofs may stick out of it, m: the measured one, and a little."""
    measured = 0.0 if cover is None or cover.fine is None else cover.fine.largest_overhang
    stated = (ball.radius - (ball.inner or 0.0) for ball in _stated(shapes, cover))
    return SETTINGS.fine_overhang + max((measured, *stated))


def covers_text(covers: Iterable[LinkCover]) -> str:
    """Covers as a text, to be stored."""
    return json.dumps(
        {
            cover.link: {
                "overhang": cover.overhang,
                "coarse": None if cover.coarse is None else cover.coarse.text,
                "fine": None if cover.fine is None else cover.fine.text,
            }
            for cover in covers
        }
    )


def read_covers(text: str) -> dict[str, LinkCover]:
    """The covers that a text states, by the links' names.

    Raises:
        InvalidProblem: ``covers`` is no such text.
    """
    try:
        stated: Mapping[str, Any] = json.loads(text)
        wrong = next((link for link, entry in stated.items() if not 0.0 < float(entry["overhang"]) < 1.0), None)
        if wrong is not None:
            raise ValueError(f"the overhang of {wrong!r}")
        return {
            link: LinkCover(
                link,
                float(entry["overhang"]),
                *(None if entry[key] is None else Cover.from_text(entry[key]) for key in ("coarse", "fine")),
            )
            for link, entry in stated.items()
        }
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InvalidProblem("covers", f"no covers of links: {error}") from error


def placed(balls: Balls, rotation: FloatArray, translation: FloatArray) -> Balls:
    """Balls as seen from the frame in which their own has this pose."""
    return Balls(balls.centers @ rotation.T + translation, balls.radii)
