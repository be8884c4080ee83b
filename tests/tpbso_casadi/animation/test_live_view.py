"""The view of a motion in viser's scene, with a scene that only notes what it is given."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.moving_plans import moving_space_plan, plane_plan

import tpbso_casadi as tp
from tpbso_casadi.animation import live_view


class Handle(SimpleNamespace):
    """Anything of a scene or a panel."""

    def on_update(self, call: Any) -> None:
        self.updated = call

    def on_click(self, call: Any) -> None:
        self.clicked = call


class Server:
    """A server of viser that keeps what is added to its scene and panel."""

    def __init__(self, port: int, verbose: bool) -> None:
        self.port, self.added, self.stopped = port, {}, False
        self.scene = self.gui = self

    def __getattr__(self, name: str) -> Any:
        def add(label: str, *values: Any, **keys: Any) -> Handle:
            self.added[label] = Handle(kind=name, value=values[-1] if values else None, **keys)
            return self.added[label]

        return add

    def get_port(self) -> int:
        return self.port

    def stop(self) -> None:
        self.stopped = True


@pytest.fixture
def viser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", SimpleNamespace(ViserServer=Server, __spec__=object()))
    monkeypatch.setattr(live_view, "find_spec", lambda name: object())


@pytest.mark.usefixtures("viser")
def test_links_and_obstacles_move_with_the_time() -> None:
    plan = tp.Plan(moving_space_plan())
    view = plan.view(port=9000)
    added: Any = view.server.added  # type: ignore[attr-defined]
    balls = {name: handle for name, handle in added.items() if name.startswith("/robot/ball")}
    (obstacle,) = (handle for name, handle in added.items() if name.startswith("/obstacles") and "wxyz" in vars(handle))
    first, there = {name: handle.position for name, handle in balls.items()}, obstacle.position
    view.show(plan.duration)
    assert max(np.abs(handle.position - first[name]).max() for name, handle in balls.items()) > 0.05
    assert np.abs(obstacle.position - there).max() > 0.01
    assert repr(view) == "<view of a motion at http://localhost:9000>"
    view.stop()
    assert view.server.stopped


@pytest.mark.usefixtures("viser")
def test_a_stage_is_gone_to() -> None:
    arm, start = tp.robot("ur5e"), [0.0, -1.6, 1.4, -1.4, -1.57, 0.0]
    view = tp.sequence(arm, start=start, stages=[[0.3, *start[1:]], tp.Wait(0.2), start]).view()
    added: Any = view.server.added  # type: ignore[attr-defined]
    added["stage 3 (move)"].clicked(None)
    assert added["time [s]"].value > 0.2 and added[""].content in ("stage 2 (wait)", "stage 3 (move)")
    view.stop()


def test_what_has_no_view_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="a view is of robots in space"):
        tp.Plan(plane_plan()).view()
    monkeypatch.setattr(live_view, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"a view needs the package viser: pip install 'tpbso-casadi\[viser\]'"):
        tp.Plan(moving_space_plan()).view()
