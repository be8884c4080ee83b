"""[layout]: what of a cell is free, and how its layout is searched."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated

from problems.base import Checked, Count, InvalidTable, Range
from tpbso_casadi.scenario.catalogues import current_name
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    LARGEST_SEED,
    MOST_EVALUATIONS,
    Interval,
    Name,
    NotNegative,
    Positive,
    Quaternion,
    Section,
    Word,
)

MOST_FREE, MOST_MOUNTINGS, MOST_RESTARTS, MOST_CERTIFIED = 100, 20, 1_000, 100


class FreeSection(Section):
    """A table of [[layout.free]]: a frame, or the robot's base, that may stand elsewhere and be turned.

    Attributes:
        place: the name of a frame, or "robot" for the base.
        x: least and most coordinate where it is stated, in the world or a frame, m; as stated where None.
        y: likewise.
        z: likewise.
        turn: about the vertical axis, on from how it is stated, rad; a whole turn goes round.
        mountings: quaternions of which one takes the place of the stated one, before it is turned.
    """

    place: Name
    x: Interval | None = None
    y: Interval | None = None
    z: Interval | None = None
    turn: Annotated[Interval | None, ANGULAR] = None
    mountings: Annotated[list[Quaternion], Count(0, MOST_MOUNTINGS)] = field(default_factory=list)

    def check(self) -> None:
        ranges = {key: getattr(self, key) for key in ("x", "y", "z", "turn") if getattr(self, key) is not None}
        if not ranges:
            raise InvalidTable("missing key; one of x, y, z and turn is free: x = [least, most]", "x")
        for key, (low, high) in ranges.items():
            if not low < high:
                raise InvalidTable(f"the first number has to be less than the second, not {low:g} and {high:g}", key)


class ApartSection(Section):
    """A table of [[layout.apart]]: what keeps a distance from what, seen from above.

    Attributes:
        between: two names of frames or obstacles, or "robot" for its base.
        distance: m.
    """

    between: Annotated[list[Name], Count(2, 2)]
    distance: NotNegative = 0.0


class LayoutSection(Section):
    """[layout]: what is free, and how it is searched; `tpbso layout` and `tp.layout` read it, nothing else does.

    Attributes:
        free: what may stand elsewhere.
        apart: what keeps a distance.
        solver: of the search.
        evaluations: of layouts, in each search.
        restarts: searches, each with a seed of its own.
        time_limit: of each search, s; the certified plans come after it.
        finalists: the best layouts that lie apart of which certified plans are made.
        spare: kept from everything in the search beyond what a certificate needs, m.
        seed: of the first search.
    """

    free: Annotated[list[FreeSection], Count(1, MOST_FREE)]
    apart: Annotated[list[ApartSection], Count(0, MOST_FREE)] = field(default_factory=list)
    solver: Annotated[Word, Checked(current_name)] = "abso"
    evaluations: Annotated[int, Range(above=0, most=MOST_EVALUATIONS)] = 2_000
    restarts: Annotated[int, Range(above=0, most=MOST_RESTARTS)] = 1
    time_limit: Positive | None = None
    finalists: Annotated[int, Range(above=0, most=MOST_CERTIFIED)] = 5
    spare: NotNegative = 0.005
    seed: Annotated[int, Range(0, LARGEST_SEED)] = 1
