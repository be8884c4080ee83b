"""SRDF: which links of a robot may touch, and where its groups of joints begin and end."""

from __future__ import annotations

from problems.base import InvalidProblem
from problems.robots.urdf_elements import document, name_of

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


def srdf_chain(text: str, group: str | None = None) -> tuple[str, str] | None:
    """The base and the tip of a group.

    Args:
        text: of the file.
        group: its name; by default that of which alone a chain is stated.

    Returns:
        Names of links; None where no group is asked for and no chain, or more than one, is stated.

    Raises:
        InvalidProblem: ``group`` has no chain in the file, or ``srdf`` is impossible.
    """
    try:
        chains = {
            name_of(found): (name_of(chain, "base_link"), name_of(chain, "tip_link"))
            for found in document(text).findall("group")
            for chain in found.findall("chain")[:1]
        }
    except InvalidProblem as error:
        raise InvalidProblem("srdf", error.reason) from error
    if group is None:
        return next(iter(chains.values())) if len(chains) == 1 else None
    if group not in chains:
        known = f"; there are {', '.join(chains)}" if chains else ""
        raise InvalidProblem("group", f"the SRDF states no chain of a group {group!r}{known}")
    return chains[group]
