"""``tp.sequence`` and the stages that it is made of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar, cast

from problems import Obstacle
from problems.base import shown_value
from tpbso_casadi.facade.arguments import AnySolverChoice, as_argument, in_words_of_python, several
from tpbso_casadi.facade.frames import Frame
from tpbso_casadi.facade.own import AnyConstraint, constraints_table
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.planning import plan
from tpbso_casadi.facade.robots import AnyRobot, StatedRobot, robot
from tpbso_casadi.facade.statement import (
    AROUND,
    HasScenario,
    What,
    given_scenario,
    goals_of,
    obstacle_of,
    place_of,
    places_of,
)
from tpbso_casadi.planning import SILENT, Progress, SequenceBound
from tpbso_casadi.planning import bound as bound_of
from tpbso_casadi.scenario import FRAMES, InputFolder, Scenario, ScenarioError, parse_scenario, plain


@dataclass(frozen=True, eq=False)
class StatedStage:
    """One stage of a sequence; its fields are the keys of [[task.stages]]."""

    kind: ClassVar[str] = ""

    def table(self, arm: StatedRobot, name: str) -> dict[str, Any]:
        """The table that states it for a robot.

        Args:
            arm: the robot.
            name: of the argument, for messages.

        Raises:
            ScenarioError: a field is none of what it may be.
        """
        stated = {each.name: getattr(self, each.name) for each in fields(self)}
        given = {key: value for key, value in stated.items() if value is not None}
        if "constraints" in given:
            given["constraints"] = _own_constraints(given["constraints"], arm, name)
        readers = {"goal": goals_of, "via": places_of}
        dof = len(arm.model.arms.get(given.get("arm", ""), ())) or arm.dof
        for key, read in readers.items():
            if key in given:
                given[key] = read(given[key], dof, arm.model.dim, f"{name}.{key}")
        return {"kind": self.kind, **plain(given)}


def _own_constraints(constraints: Any, arm: StatedRobot, name: str) -> list[dict[str, Any]]:
    stated = constraints_table(constraints, arm.model)
    if stated["limits"]:
        raise ScenarioError(f"{name}.constraints: classes of limits hold for a whole sequence, constraints=...")
    return list(stated["constraints"])


@dataclass(frozen=True, eq=False)
class MoveTo(StatedStage):
    """Move to a place in the least time.

    Args:
        goal: joint values, a point, a pose, a frame (4, 4), as of :func:`plan`; or a list of which any will do.
        arm: that moves, of a robot with several: goal and vias are its own, and the others end where they begin.
        via: places that are passed, in this order.
        blend: how far from its goal the motion may pass, m of the tool or rad of all joints together; it then goes on
            without a stop to the goal of the next stage, a move as well.
        may_touch: pairs of names of links, obstacles and what is carried whose contact is allowed in this stage.
        margin: kept from everything in this stage, m.
        constraints: of your own that hold in this stage, such as :class:`Constraint`.
        max_speed: of the joints in this stage, rad/s, one number or (dof,).
        max_acceleration: likewise, rad/s^2.
        max_jerk: likewise, rad/s^3.
        payload: at the tool in this stage, a table with ``mass`` in kg and ``center`` in m.
    """

    kind: ClassVar[str] = "move"

    goal: Any
    arm: str | None = None
    via: Any = None
    blend: float | None = None
    may_touch: Sequence[tuple[str, str]] | None = None
    margin: float | None = None
    constraints: AnyConstraint | Iterable[AnyConstraint] | None = None
    max_speed: Any = None
    max_acceleration: Any = None
    max_jerk: Any = None
    payload: Mapping[str, Any] | None = None


@dataclass(frozen=True, eq=False)
class Line(StatedStage):
    """The tool goes straight, or along an arc; where no orientation is stated it stays turned as it is.

    Args:
        goal: where it ends, a point or a pose; or ``by``, or ``along``.
        arm: whose tool goes, of a robot with several.
        frame: in which goal, ``by`` and points are stated: the name of one of the call's ``frames``, or of the arm in
            the frame of whose tool they are, such as a turntable that may turn.
        by: how far it goes along the axes of the world, (dim,), m.
        along: how far it goes along the axes of the tool, as it is turned at first, (3,), m.
        through: a point of an arc to the goal, (dim,), m.
        accuracy: how far the tool may be from the line, m.
        angular_accuracy: how far it may be turned from what it should be, rad.
        free: an axis of the tool, ``"x"``, ``"y"`` or ``"z"``, about which any turn will do.
        turn: the least and the most turn about it, rad, where not any will do.
        tilt: how far this axis may lean, rad.
        max_tool_speed: m/s.
        tool_speed: that the tool keeps, but next to ends and corners, m/s; or a table with ``speed``, ``tolerance`` (a
            share), ``at_ends`` and ``at_corners`` (m).
        may_touch: as of :class:`MoveTo`, and so are all others.
        margin: m.
        constraints: of your own.
        max_speed: rad/s.
        max_acceleration: rad/s^2.
        max_jerk: rad/s^3.
        payload: a table.
    """

    kind: ClassVar[str] = "line"

    goal: Any = None
    arm: str | None = None
    frame: str | None = None
    by: Any = None
    along: Any = None
    through: Any = None
    accuracy: float | None = None
    angular_accuracy: float | None = None
    free: str | None = None
    turn: Sequence[float] | None = None
    tilt: float | None = None
    max_tool_speed: float | None = None
    tool_speed: float | Mapping[str, Any] | None = None
    may_touch: Sequence[tuple[str, str]] | None = None
    margin: float | None = None
    constraints: AnyConstraint | Iterable[AnyConstraint] | None = None
    max_speed: Any = None
    max_acceleration: Any = None
    max_jerk: Any = None
    payload: Mapping[str, Any] | None = None


@dataclass(frozen=True, eq=False)
class Along(StatedStage):
    """The tool goes from where it is straight to points, one after the other, and rounds its corners.

    Args:
        points: (n, dim), m; or a CSV file of them.
        accuracy: how far the tool may be from the straight lines, corners included, m.
        arm: whose tool goes, of a robot with several.
        frame: in which goal, ``by`` and points are stated: the name of one of the call's ``frames``, or of the arm in
            the frame of whose tool they are, such as a turntable that may turn.
        angular_accuracy: how far it may be turned from how it is at first, rad.
        free: as of :class:`Line`.
        turn: likewise.
        tilt: likewise.
        max_tool_speed: m/s.
        tool_speed: that the tool keeps, but next to ends and corners, m/s; or a table with ``speed``, ``tolerance`` (a
            share), ``at_ends`` and ``at_corners`` (m).
        may_touch: as of :class:`MoveTo`, and so are all others.
        margin: m.
        constraints: of your own.
        max_speed: rad/s.
        max_acceleration: rad/s^2.
        max_jerk: rad/s^3.
        payload: a table.
    """

    kind: ClassVar[str] = "path"

    points: Any
    accuracy: float
    arm: str | None = None
    frame: str | None = None
    angular_accuracy: float | None = None
    free: str | None = None
    turn: Sequence[float] | None = None
    tilt: float | None = None
    max_tool_speed: float | None = None
    tool_speed: float | Mapping[str, Any] | None = None
    may_touch: Sequence[tuple[str, str]] | None = None
    margin: float | None = None
    constraints: AnyConstraint | Iterable[AnyConstraint] | None = None
    max_speed: Any = None
    max_acceleration: Any = None
    max_jerk: Any = None
    payload: Mapping[str, Any] | None = None


@dataclass(frozen=True, eq=False)
class Attach(StatedStage):
    """Take up an obstacle by its name, as it lies; or a body of its own.

    Args:
        name: of the obstacle, or of the body.
        body: a shape in the tool's frame, such as :class:`Box`, or its table; an obstacle where None.
        mass: kg; what is carried has no weight where None, which is said beside the certificate.
        touch: names of links, obstacles and what else is carried, whose contact with it is allowed while it is held.
        arm: whose hand takes it up, of a robot with several; the first by default.
    """

    kind: ClassVar[str] = "attach"

    name: str
    body: Obstacle | Mapping[str, Any] | None = None
    mass: float | None = None
    touch: Sequence[str] | None = None
    arm: str | None = None

    def table(self, arm: StatedRobot, name: str) -> dict[str, Any]:
        own = {"kind": self.kind, "name": self.name}
        own |= {key: plain(getattr(self, key)) for key in ("mass", "touch", "arm") if getattr(self, key) is not None}
        body = None if self.body is None else obstacle_of(self.body, f"{name}.body")
        if isinstance(body, Obstacle):
            return own | {"body": replace(body, name=self.name)}
        return own if body is None else body | own


@dataclass(frozen=True, eq=False)
class Detach(StatedStage):
    """Leave what is carried where it is; it is an obstacle from then on.

    Args:
        name: of what is carried.
    """

    kind: ClassVar[str] = "detach"

    name: str


@dataclass(frozen=True, eq=False)
class Wait(StatedStage):
    """Stand still for a while.

    Args:
        seconds: for how long.
    """

    kind: ClassVar[str] = "wait"

    seconds: float


@dataclass(frozen=True, eq=False)
class Output(StatedStage):
    """Tell a signal, such as a gripper's, at this moment; exports say when.

    Args:
        signal: its name.
        value: that it has from now on.
    """

    kind: ClassVar[str] = "output"

    signal: str
    value: bool | float | str = True


def sequence(
    arm: AnyRobot,
    *,
    start: Any,
    stages: Iterable[Any],
    cyclic: bool = False,
    order: str = "given",
    obstacles: Iterable[Obstacle | dict[str, Any]] | str | Path | None = None,
    carried: Iterable[Obstacle | dict[str, Any]] | None = None,
    may_touch: Iterable[tuple[str, str]] | None = None,
    frames: Iterable[Frame | dict[str, Any]] | None = None,
    solver: AnySolverChoice | None = None,
    seed: int | None = None,
    within: float | None = None,
    progress: Progress = SILENT,
    **keys: Any,
) -> Plan:
    """Plan stages one after the other, in the postures with which all of them together take least.

    Args:
        arm: the robot, as of :func:`robot`.
        start: where it is at first, as of :func:`plan`.
        stages: :class:`MoveTo`, :class:`Line`, :class:`Along`, :class:`Attach`, :class:`Detach`, :class:`Wait`,
            :class:`Output`, or their tables; a place by itself is moved to.
        cyclic: whether the last stage, a move, ends in the posture in which the first begins.
        order: ``given``, or ``free`` where the moves, each with the waits and signals behind it, may come in any order;
            a last one that is cyclic stays the last.
        obstacles: to keep clear of, as of :func:`plan`; they stand still unless they are taken up.
        carried: what the tool holds from the start, likewise.
        may_touch: pairs of names whose contact is always allowed.
        frames: in which places, ways and obstacles, and the robot's base, may be stated, each by its name.
        solver: of the moves, as of :func:`plan`.
        seed: same seed, same result.
        within: the best plan in so many seconds, s.
        progress: is told what begins.
        keys: further keys of the scenario's tables [model] and [solver], such as ``margin`` or ``constraints``.

    Returns:
        The plan of all stages; ``plan.stages`` are those, each with its verdicts.

    Raises:
        ScenarioError: naming the first wrong argument or stage; or a stage for which no motion was found.
        TypeError: a keyword that no table has.
    """
    with in_words_of_python():
        around = {"obstacles": obstacles, "carried": carried, "may_touch": may_touch, FRAMES: frames}
        scenario = _sequence_scenario(arm, start, stages, cyclic, order, around)
        return plan(scenario, solver=solver, seed=seed, within=within, progress=progress, **keys)


def bound(
    what: What | HasScenario,
    *,
    start: Any = None,
    stages: Iterable[Any] | None = None,
    cyclic: bool = False,
    order: str = "given",
    obstacles: Iterable[Obstacle | dict[str, Any]] | str | Path | None = None,
    carried: Iterable[Obstacle | dict[str, Any]] | None = None,
    may_touch: Iterable[tuple[str, str]] | None = None,
    frames: Iterable[Frame | dict[str, Any]] | None = None,
) -> SequenceBound:
    """The least time of a sequence between its postures, without planning its motions.

    Args:
        what: a scenario of a sequence, its file, or a plan of one; or a robot, for which the others state one.
        start: as of :func:`sequence`, and so are all others.
        stages: likewise.
        cyclic: likewise.
        order: likewise.
        obstacles: likewise.
        carried: likewise.
        may_touch: likewise.
        frames: likewise.

    Returns:
        The bound: ``seconds``, ``stages`` with their times, ``postures``; ``why`` there is no way, where there is none.

    Raises:
        ScenarioError: naming the first wrong argument; or it is no sequence.
    """
    around = {"obstacles": obstacles, "carried": carried, "may_touch": may_touch, FRAMES: frames}
    with in_words_of_python():
        if stages is None:
            known = given_scenario(what)
        else:
            known = _sequence_scenario(cast(AnyRobot, what), start, stages, cyclic, order, around)
        if known is None:
            raise ScenarioError("stages: missing; say what the robot does, stages=[tp.MoveTo(...), ...]")
        found = bound_of(known)
        return replace(found, why=as_argument(found.why))


def _sequence_scenario(
    arm: AnyRobot, start: Any, stages: Iterable[Any], cyclic: bool, order: str, around: dict[str, Any]
) -> Scenario:
    """The scenario of stages of a robot and of what is around it."""
    beside = {key: AROUND[key](value) for key, value in around.items() if value is not None}
    stated = robot(arm)
    placed = stated.based_in(beside.get(FRAMES, ()))
    listed = several("stages", stages, "stages")
    task = {
        "kind": "sequence",
        "start": place_of(start, placed.dof, placed.model.dim, "start"),
        "stages": [_stage_table(stage, placed, f"stages[{number}]") for number, stage in enumerate(listed)],
        "cyclic": cyclic,
        "order": order,
    }
    content = stated.tables | {"task": task} | beside
    return parse_scenario(content, InputFolder(Path(), outside_allowed=True))


def _stage_table(stage: Any, arm: StatedRobot, name: str) -> dict[str, Any]:
    if isinstance(stage, StatedStage):
        return stage.table(arm, name)
    if isinstance(stage, Mapping) and "kind" in stage:
        return dict(plain(stage))
    try:
        return MoveTo(stage).table(arm, name)
    except ScenarioError as error:
        reason = f"a stage such as tp.Line(...), or a place, is needed, not {shown_value(stage)}"
        raise ScenarioError(f"{name}: {reason}") from error
