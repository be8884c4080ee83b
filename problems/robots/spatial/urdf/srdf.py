"""Links that may touch, as an SRDF names them."""

from __future__ import annotations

from problems.base.errors import InvalidProblem
from problems.robots.spatial.urdf.document import document, name_of

MOST_PAIRS = 100_000


def read_srdf(text: str) -> tuple[tuple[str, str], ...]:
    """The pairs of links in the ``disable_collisions`` of a file.

    Raises:
        InvalidProblem: ``srdf`` is impossible, with the reason in one line.
    """
    try:
        found = document(text).findall("disable_collisions")
        pairs = tuple((name_of(pair, "link1"), name_of(pair, "link2")) for pair in found[: MOST_PAIRS + 1])
    except InvalidProblem as error:
        raise InvalidProblem("srdf", error.reason) from error
    if not 0 < len(pairs) <= MOST_PAIRS:
        raise InvalidProblem("srdf", "no <disable_collisions>" if not pairs else f"more than {MOST_PAIRS} pairs")
    return pairs
