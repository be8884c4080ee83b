"""Spheres from a file: on the bodies that carry their links, or one line for what is wrong."""

from __future__ import annotations

import pytest
from helpers.urdf import ARM

from problems import InvalidProblem
from problems.robots import read_spheres, read_urdf

LINKS = read_urdf(ARM, tip_link="tool0").links
SPHERE = '[[spheres]]\nlink = "mast"\ncenter = [0.1, 0, 0.2]\nradius = 0.05\n'


def test_spheres_are_moved_to_the_bodies_that_carry_their_links() -> None:
    text = "".join(SPHERE.replace("mast", link) for link in ("world", "base", "mast", "bolted", "tool0"))
    world, base, mast, bolted, tool = read_spheres(text, LINKS)
    assert [sphere.link for sphere in (world, base, mast, bolted, tool)] == [0, 0, 1, 1, 2]
    assert world.center == (0.1, 0.0, 0.2)
    assert base.center == (0.1, 0.0, 1.2)  # the stand is 1 m high
    assert bolted.center == (0.4, 0.0, 0.2)
    assert tool.center == pytest.approx((0.1, 0.0, 0.0))  # upside down, 0.2 m from the jib
    assert (tool.radius, tool.name) == (0.05, "tool0")


def test_capsules_are_held_by_spheres() -> None:
    text = '[[capsules]]\nlink = "mast"\nstart = [0, 0, 0]\nend = [0, 0, 0.3]\nradius = 0.05\n'
    spheres = read_spheres(SPHERE + text, LINKS)
    assert spheres[0].center == (0.1, 0.0, 0.2)
    assert spheres[1].center == (0.0, 0.0, 0.0)
    assert spheres[-1].center == pytest.approx((0.0, 0.0, 0.3))
    assert all(0.05 <= sphere.radius < 0.0556 for sphere in spheres[1:])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("spheres = [", "not TOML: "),
        ("", r"neither \[\[spheres\]\] nor \[\[capsules\]\]"),
        ("spheres = []", r"neither \[\[spheres\]\] nor \[\[capsules\]\]"),
        ("spheres = 3", r"\[\[spheres\]\] is a list of tables"),
        ("spheres = [3]", "sphere 1: needs center, link, radius and nothing else"),
        ("[[balls]]\nradius = 1", "unknown key 'balls'; there are spheres, capsules"),
        (SPHERE + "colour = 1", "sphere 1: needs center, link, radius and nothing else"),
        (SPHERE.replace("mast", "sail"), "sphere 1: no link 'sail' in the chain; there are world, base, mast"),
        (SPHERE.replace('"mast"', "7"), "sphere 1: no link 7 in the chain"),
        (SPHERE.replace("0.05", "0"), "sphere 1: radius: 0 m is not above 0"),
        (SPHERE.replace("0.05", "true"), "sphere 1: radius: a number is needed, not 'True'"),
        (SPHERE.replace("0.05", "nan"), "sphere 1: radius: nan is not within 10000 m"),
        (SPHERE.replace("0.05", "1" + "0" * 400), "a number of more than 300 digits is not within 10000 m"),
        (SPHERE.replace("0.05", "1" * 5000), "a whole number of thousands of digits"),
        (SPHERE.replace("[0.1, 0, 0.2]", "[0.1, 0]"), "sphere 1: center: three coordinates are needed"),
        (SPHERE.replace("[0.1, 0, 0.2]", '"here"'), "sphere 1: center: three coordinates are needed"),
        (SPHERE.replace("[0.1, 0, 0.2]", '[0.1, 0, "up"]'), "sphere 1: center: a number is needed, not 'up'"),
        (SPHERE * 1_001, "more than 1000"),
        ("#" * 1_000_001, "1000001 characters, of at most 1000000"),
        ("a." * 60 + "b = 1", "a key of more than 50 parts"),
    ],
)
def test_what_is_wrong_is_named(text: str, message: str) -> None:
    with pytest.raises(InvalidProblem, match="^spheres: .*" + message):
        read_spheres(text, LINKS)
