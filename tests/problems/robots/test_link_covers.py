"""Covers of links as a text: what is read is what was written; anything else is refused in one line."""

from __future__ import annotations

import json

import pytest

from problems.base import InvalidProblem
from problems.geometry import box_corners, cover_of
from problems.robots import LinkCover, covers_text, read_covers
from problems.robots.link_covers import cover_link
from problems.robots.shapes import BoxShape

COVER = cover_of(box_corners((0.06, 0.06, 0.1)), 0.02)
TEXT = covers_text([LinkCover("one", 0.02, None, COVER), LinkCover("two", 0.01, COVER, COVER)])


def test_what_is_read_is_what_was_written() -> None:
    read = read_covers(TEXT)
    assert covers_text(read.values()) == TEXT
    assert read["one"].coarse is None and read["one"].searched == ()
    assert all(ball.inner == pytest.approx(max(ball.radius - 0.01, 0.0)) for ball in read["two"].searched)


@pytest.mark.parametrize(
    "text",
    [
        *("", "[]", "1", '{"one": 1}', '{"one": {}}', '{"one": {"overhang": 0.02, "coarse": "?", "fine": null}}'),
        *(TEXT.replace("0.02", value) for value in ("NaN", "-1", '"a"', "5")),
        json.dumps({"one": {"overhang": 0.02, "coarse": 3, "fine": None}}),
        TEXT[:-100],
    ],
)
def test_anything_else_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(InvalidProblem, match=r"^covers?: ") as error:
        read_covers(text)
    assert "\n" not in str(error.value)


def test_spheres_of_large_links_stick_out_in_proportion() -> None:
    """Of a bar of 2 m twice as far as of one up to 1 m; of one that stands, ten times."""
    for length, stands, share in ((0.9, False, 1.0), (2.0, False, 2.0), (2.0, True, 10.0)):
        bar = BoxShape(sizes=(0.1, 0.1, length))
        fine = cover_link("bar", [bar], lambda mesh: b"", 0.02, 0.01, stands)[0].fine
        assert fine is not None
        assert 0.009 * share < fine.largest_overhang <= 0.01 * share * 1.01
