"""Sequences as tables, and what is where while one goes on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, NoReturn, Self

from problems import Obstacle, Robot
from problems.assembly import Criteria, SequenceCriteria
from problems.base import Count, InvalidTable, in_words
from problems.objectives import OBJECTIVES
from problems.tasks import Sequence as StagedTask
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.model import ModelSection, TaskSection
from tpbso_casadi.scenario.obstacles import with_files
from tpbso_casadi.scenario.places import AnyPlace
from tpbso_casadi.scenario.stage_section import StageSection
from tpbso_casadi.scenario.stages import AnyStage, MoveStage
from tpbso_casadi.scenario.validation import ScenarioError

MOST_STAGES, MOST_VISITS = 200, 30
VISITS = ("move", "wait", "output")  # kinds of stages whose order may be free


class SequenceTask(TaskSection):
    """[task] of stages one after the other, from a start on; the arm stands between them."""

    is_searched: ClassVar[bool] = False
    motions: ClassVar[tuple[str, ...]] = ("spline",)

    kind: Literal["sequence"]
    start: AnyPlace
    stages: Annotated[list[AnyStage], Count(1, MOST_STAGES)]
    cyclic: bool = False
    order: Literal["given", "free"] = "given"

    def check(self) -> None:
        super().check()
        moving = [number for number, stage in enumerate(self.stages) if stage.moves]
        if not moving:
            raise InvalidTable("none of them moves the arm", "stages")
        if self.cyclic and self.stages[moving[-1]].kind != "move":
            reason = "the last that moves ends a cycle, and so is to be kind = 'move'"
            raise InvalidTable(reason, "stages", moving[-1], "kind")
        for number, stage in enumerate(self.stages):
            if isinstance(stage, MoveStage) and stage.blend is not None:
                self._check_blend(stage, number)
        if self.order == "free":
            self._check_visits()

    def _check_blend(self, stage: MoveStage, number: int) -> None:
        reason = stage.unlike(self.stages[number + 1 : number + 2])
        if self.order == "free":
            reason = "in a free order moves end at rest"
        if reason is not None:
            raise InvalidTable(reason, "stages", number, "blend")

    def _check_visits(self) -> None:
        for number, stage in enumerate(self.stages):
            if stage.kind not in VISITS:
                raise InvalidTable(f"in a free order stages are {in_words(VISITS)}", "stages", number, "kind")
        if not 1 <= len(self.visits) <= MOST_VISITS:
            raise InvalidTable(f"{len(self.visits)} moves; from 1 to {MOST_VISITS} are put in order", "order")

    @property
    def visits(self) -> list[list[StageSection]]:
        """The moves, each with what is done before the next; a last one that ends a cycle is none of them."""
        starts = [number for number, stage in enumerate(self.stages) if stage.moves]
        ends = [*starts[1:], len(self.stages)]
        found = [self.stages[start:end] for start, end in zip(starts, ends, strict=True)]
        return found[:-1] if self.cyclic else found

    def in_order(self, order: Sequence[int]) -> SequenceTask:
        """The task with its visits in another order, which is given from then on."""
        moves = [number for number, stage in enumerate(self.stages) if stage.moves]
        before, after = self.stages[: moves[0]], self.stages[moves[-1] :] if self.cyclic else []
        stages = [*before, *(stage.in_stated_turns for visit in order for stage in self.visits[visit]), *after]
        return self.replaced(stages=stages, order="given")

    @property
    def stated_objective(self) -> str:
        return "time"

    @property
    def legs(self) -> list[tuple[range, StageSection]]:
        """The stages as the arm runs them, with their numbers from 0 on: blended moves are one with those behind.

        In a free order, and at the end of a cycle, joints have the stated values.
        """
        found: list[tuple[range, StageSection]] = []
        ending = max(number for number, stage in enumerate(self.stages) if stage.moves) if self.cyclic else -1
        for number, each in enumerate(self.stages):
            stage = each.in_stated_turns if self.order == "free" or number == ending else each
            before = found[-1][1] if found else None
            if isinstance(before, MoveStage) and before.blend is not None and isinstance(stage, MoveStage):
                found[-1] = range(found[-1][0].start, number + 1), before.blended(stage)
            else:
                found.append((range(number, number + 1), stage))
        return found

    @property
    def labels(self) -> list[str]:
        """The names of the legs, in their order."""
        return [_label(numbers, stage.kind) for numbers, stage in self.legs]

    def with_files(self, folder: InputFolder) -> Self:
        return self.replaced(stages=with_files(self.stages, folder, "task.stages"))

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> NoReturn:
        """Refuse to build one problem: each stage has a problem of its own.

        Raises:
            ScenarioError: always.
        """
        raise ScenarioError(f"task.kind: {self.kind!r} is of several motions; there is no one problem to state")

    def criteria(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        return SequenceCriteria(task=StagedTask(robot, obstacles), objective=OBJECTIVES["time"], limits=())


def _label(numbers: range, kind: str) -> str:
    one = f"stage {numbers[0] + 1}" if len(numbers) == 1 else f"stages {numbers[0] + 1} to {numbers[-1] + 1}"
    return f"{one} ({kind})"
