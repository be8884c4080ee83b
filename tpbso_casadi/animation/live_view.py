"""A motion in space in the scene of viser, which browsers and notebooks show: links, obstacles, time and stages."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from threading import Thread
from time import perf_counter, sleep
from typing import Any

import numpy as np

from problems.base import FloatArray
from problems.robots import quaternions_of
from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.figures.palette import GREEN, OBSTACLE
from tpbso_casadi.figures.scene import courses_of
from tpbso_casadi.planning import JudgedMotion

NEUTRAL = "#b8c0c8"  # of a link whose colour nobody states
PERIOD = 1.0 / 30.0  # s between pictures while it plays


class LiveView:
    """A motion in the scene of a viser server, which runs until :meth:`stop`.

    Args:
        motion: of a robot in space.
        port: of the server.

    Attributes:
        server: of viser, to which more can be added.

    Raises:
        ImportError: viser is not installed.
        ValueError: the robot is in the plane.
    """

    def __init__(self, motion: JudgedMotion, port: int) -> None:
        if motion.criteria.robot.dim != 3:
            raise ValueError("a view is of robots in space; plan.player() shows this one")
        if find_spec("viser") is None:
            raise ImportError("a view needs the package viser: pip install 'tpbso-casadi[viser]'")
        import viser  # noqa: PLC0415 (optional, and slow to load)

        self._motion, self._scene = motion, frames_of(motion, 2).scene
        self.server = viser.ViserServer(port=port, verbose=False)
        self._bodies: list[tuple[Any, int]] = []  # a mesh and the number of its body
        self._balls: list[tuple[Any, int]] = []
        self._moving: list[Any] = []
        self._add_scene()
        self._slider = self.server.gui.add_slider("time [s]", 0.0, motion.trajectory.duration, 1e-3, 0.0)
        self._playing = self.server.gui.add_checkbox("play", False)
        self._stage = self.server.gui.add_markdown("")
        for stage in motion.stages:
            if stage.end > stage.start:
                self._add_stage(stage.label, stage.start)
        self._slider.on_update(lambda event: self.show(self._slider.value))
        self._stopped = False
        Thread(target=self._play, daemon=True).start()
        self.show(0.0)

    def __repr__(self) -> str:
        return f"<view of a motion at http://localhost:{self.server.get_port()}>"

    def _add_stage(self, label: str, start: float) -> None:
        def jump(event: Any) -> None:
            self._slider.value = start
            self.show(start)

        self.server.gui.add_button(label).on_click(jump)

    def _add_scene(self) -> None:
        add = self.server.scene
        for number, look in enumerate(self._scene.appearances):
            name, colour = f"/robot/{number} {look.link}", _rgb(look.colour or NEUTRAL)
            mesh = add.add_mesh_simple(name, look.triangles.vertices, look.triangles.faces, color=colour)
            self._bodies.append((mesh, look.body))
        for ball in self._scene.bare:
            name, radius = f"/robot/ball {ball}", float(self._scene.radii[ball])
            self._balls.append((add.add_icosphere(name, radius=radius, color=_rgb(NEUTRAL)), int(ball)))
        for number, solid in enumerate(self._scene.solids):
            name = f"/obstacles/{number + 1} {self._scene.obstacles[number].unmoved.name}".rstrip()
            handle = add.add_mesh_simple(
                name, solid.vertices, _triangles(solid.faces), color=_rgb(OBSTACLE), opacity=0.5
            )
            if number in self._scene.moving:
                self._moving.append(handle)
        for marker in self._scene.markers:
            for number, point in enumerate(marker.points):
                add.add_icosphere(f"/task/{marker.label} {number}", radius=0.008, color=_rgb(GREEN), position=point)

    def show(self, time: float) -> None:
        """Show the arm and what moves at a time in s."""
        theta = self._motion.trajectory.at(np.array([time]))
        for handle, body in self._bodies:
            _place(handle, self._scene.frames(theta)[0, body])
        centers = self._scene.centers(theta)[0]
        for handle, ball in self._balls:
            handle.position = centers[ball]
        courses = courses_of(self._motion.criteria.task.scenery, np.array([time]))
        for handle, course in zip(self._moving, courses, strict=True):
            _place(handle, course.frames[0])
        now = [stage.label for stage in self._motion.stages if stage.start <= time <= stage.end]
        self._stage.content = ", ".join(now[-1:])

    def _play(self) -> None:
        while not self._stopped:
            began = perf_counter()
            sleep(PERIOD)
            if self._playing.value:
                later = self._slider.value + perf_counter() - began
                self._slider.value = 0.0 if later > self._motion.trajectory.duration else later
                self.show(self._slider.value)

    def stop(self) -> None:
        """Stop playing, and end the server of viser."""
        self._stopped = True
        self.server.stop()


def _place(handle: Any, frame: FloatArray) -> None:
    """Move something of the scene to a frame: origin and axes in rows, (4, 3)."""
    x, y, z, w = quaternions_of(frame[1:].T.reshape(1, 9))[0]
    handle.position, handle.wxyz = frame[0], np.array([w, x, y, z])


def _triangles(faces: Sequence[Sequence[int]]) -> FloatArray:
    """The faces of a convex solid as triangles, (n, 3)."""
    return np.array([(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)])


def _rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue of #rrggbb, from 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
