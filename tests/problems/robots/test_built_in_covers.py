"""The balls of the built-in robots are proven to hold the makers' meshes: triangle by triangle, as covers are."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.slow import slow_except

from benchmarks.built_in_covers import MESHES, Meshes, NoMeshes
from problems.geometry import unheld
from problems.robots import BUILT_IN, LinkCover, RobotDescription, built_in

FINE, SHOWN = 0.00265, 0.01  # m: how far fine balls stick out; how far looks may leave them


@cache
def meshes_of(model: str) -> dict[str, Meshes]:
    try:
        return MESHES[model]()
    except NoMeshes as reason:
        pytest.skip(str(reason))


def covers_of(description: RobotDescription) -> dict[str, LinkCover]:
    return {cover.link: cover for cover in description.covers}


@pytest.mark.parametrize("model", slow_except(sorted(BUILT_IN), ["ur5e"]))
def test_both_covers_hold_the_meshes_of_every_link_and_little_more(model: str) -> None:
    """The hand of the Panda with its fingers at all openings; of some links of a UR5e the visual meshes alone."""
    meshes, covers = meshes_of(model), covers_of(built_in(model))
    assert set(meshes) == set(covers)
    for link, cover in covers.items():
        assert cover.coarse is not None and cover.fine is not None
        for corners in (meshes[link].collision, meshes[link].visual):
            assert not len(unheld(corners, cover.coarse.balls)) and not len(unheld(corners, cover.fine.balls))
            assert len(unheld(corners, cover.fine.balls.shrunk(FINE)))
        assert cover.fine.largest_overhang < FINE


@pytest.mark.parametrize("model", BUILT_IN)
def test_looks_show_every_link_near_its_cover(model: str) -> None:
    description = built_in(model)
    frames, covers = {frame.name: frame for frame in description.links}, covers_of(description)
    assert {look.link for look in description.appearances} == set(covers)
    for look in description.appearances:
        pose, fine = frames[look.link].pose, covers[look.link].fine
        assert fine is not None
        own = (look.triangles.corners - np.array(pose.translation)) @ np.array(pose.rotation)
        assert not len(unheld(own, fine.balls.shrunk(-SHOWN)))
