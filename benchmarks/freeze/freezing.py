"""A function made of its definition: instances drawn, chosen, tried, and written as kernels and numbers.

Only instances are kept that can be judged by: all of a function have one structure, hence one kernel; in each a search
finds a feasible candidate; where obstacles are stated the straight motion, which is the middle of the search box, meets
one; and where a lower bound is known the search does not come near it at once. Of those drawn the most different are
taken, by the features of their landscapes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import chain, count, islice
from typing import Any
from zlib import crc32

import numpy as np

from benchmarks.freeze.definitions import INSTANCES, Definition, NoPlace, Tables
from benchmarks.freeze.features import alike_part, features, sample_of, standardised
from problems import Problem
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction, Program, ProgramStructure
from problems.objectives import DirectMoves
from problems.timing import least_durations
from solvers import LSHADE, Budget, SearchBox, minimize
from tpbso_casadi.scenario import ScenarioError, parse_scenario
from tpbso_casadi.suite.frozen import Description, FunctionContent, check_points, digest_of
from tpbso_casadi.suite.kernels import SuiteKernel
from tpbso_casadi.suite.motions import problems_of

SEED = 1  # of the suite
SURVEYED = 10  # drawn instances of which the most frequent structure is taken
POOL, SPACE_POOL = 24, 40  # drawn instances of that structure that need a search, of which INSTANCES are chosen
SLOW = {  # functions of which the first INSTANCES that are worth it are taken, as to draw more takes minutes
    *("star-time", "star-rotation", "spline-5", "spline-7", "clutter-5", "rotation-5", "narrow-3"),
    *("torque-3", "moving-3", "moving-5", "panda-boxes", "panda-payload"),
}
MOST_DRAWN = 3000
TUNING = 5  # instances that come first, for settings to be tuned on; settings are judged on the others
EVALUATIONS = 10_000  # of a search that tries an instance
FARTHER = 1.02  # times the lower bound: what that search finds is no lower


class NotFrozen(RuntimeError):
    """A definition of which not enough instances can be had; the message names it."""


@dataclass(frozen=True, eq=False)
class Instance:
    """A scenario and its programs.

    Attributes:
        tables: of the scenario file.
        problem: of it.
        form: how objectives are seen.
    """

    tables: Tables
    problem: Problem[Any]
    form: str

    @cached_property
    def problems(self) -> list[Problem[Any]]:
        """One for each objective, all with the same search box."""
        return problems_of(self.problem, self.form)

    @cached_property
    def programs(self) -> list[tuple[Program, tuple[str, ...]]]:
        """Of merit, objective and violations, for each objective; and names of the violations."""
        return [problem.parts_program() for problem in self.problems]

    @cached_property
    def structures(self) -> list[ProgramStructure]:
        """Of the programs."""
        return [ProgramStructure(program) for program, _ in self.programs]

    @property
    def key(self) -> tuple[Any, ...]:
        """What is the same for instances of one function."""
        sizes = [part.size for pair in self.scenes() for part in pair]
        return *(structure.key for structure in self.structures), *sizes

    def scenes(self) -> list[tuple[FloatArray, Any]]:
        """Numbers and indices for each kernel."""
        return [structure.scene() for structure in self.structures]

    @cached_property
    def box(self) -> SearchBox:
        """That is searched."""
        return SearchBox(*self.problem.bounds)

    def merits(self, candidates: FloatArray) -> FloatArray:
        """Of candidates (m, d), (m,); of two objectives those of the first."""
        return self._evaluate(candidates)[:, 0]

    @cached_property
    def _evaluate(self) -> PopulationFunction:
        return PopulationFunction(self.programs[0][0], EvaluationOptions("native"))

    @cached_property
    def features(self) -> FloatArray:
        """Of the landscape of the merit."""
        sample = sample_of(self.box.dimension)
        return features(sample, self.merits(self.box.from_unit(sample.points)))

    @property
    def bound(self) -> float:
        """The merit up to which a candidate is feasible; of two objectives that of the first."""
        return self.problems[0].objective_upper_bound

    def needs_search(self) -> bool:
        """Whether the straight motion, which is the middle of the box, meets what is stated as obstacles, if any is."""
        middle = self.box.from_unit(np.full((1, self.box.dimension), 0.5))
        return not self.tables.get("obstacles") or bool(self.merits(middle)[0] > self.bound)

    @cached_property
    def is_worth_judging(self) -> bool:
        """Whether a search finds a feasible candidate, and not at once the best that there can be."""
        found = minimize(self.merits, self.box, LSHADE(), Budget(evaluations=EVALUATIONS), SEED)
        least = lower_bound(self.tables, self.problems[0])
        return bool(found.cost <= self.bound and (least is None or found.cost >= FARTHER * least))


def lower_bound(tables: Tables, problem: Problem[Any]) -> float | None:
    """What the objective of no motion that keeps all limits for all t is below; None where nothing is known.

    Known where both ends are postures: of the robot's limits alone, as if there were nothing in the way.
    """
    if not has_postures(tables):
        return None
    task = tables["task"]
    start, goal = (np.array(task[end]["joints"]) for end in ("start", "goal"))
    limits = problem.criteria.robot.limits
    durations = least_durations((goal - start)[None], limits).max(axis=1)
    moves = DirectMoves(robot=problem.criteria.robot, start=start, goals=goal[None], durations=durations)
    [least] = problem.criteria.objective.lower_bound(moves).tolist()
    return least if np.isfinite(least) else None


def has_postures(tables: Tables) -> bool:
    """Whether both ends of a scenario are postures."""
    task = tables["task"]
    return all(isinstance(task.get(end), dict) and "joints" in task[end] for end in ("start", "goal"))


def instance_of(tables: Tables, definition: Definition) -> Instance:
    """The instance of a scenario.

    Raises:
        ScenarioError: it cannot be done.
    """
    if definition.samples:
        tables = {**tables, "model": {**tables["model"], "samples": definition.samples}}
    return Instance(tables, parse_scenario(tables).problem(), definition.form)


def drawn(definition: Definition) -> Iterator[Instance]:
    """Instances that can be stated, one after the other."""
    for number in count():
        rng = np.random.default_rng([SEED, crc32(definition.name.encode()), number])
        try:
            yield instance_of(definition.draw(rng), definition)
        except (NoPlace, ScenarioError):
            continue


def chosen(definition: Definition) -> list[Instance]:
    """The instances of a function: those for tuning, then those for judging, which differ as much and alike.

    Raises:
        NotFrozen: there are not enough.
    """
    stream = islice(drawn(definition), MOST_DRAWN)
    surveyed = list(islice(stream, SURVEYED))
    key = Counter(instance.key for instance in surveyed).most_common(1)[0][0]
    alike = (instance for instance in chain(surveyed, stream) if instance.key == key and instance.needs_search())
    if definition.name in SLOW:
        pool = list(islice((instance for instance in alike if instance.is_worth_judging), INSTANCES))
    else:
        pool = list(islice(alike, SPACE_POOL if definition.group == "space" else POOL))
    table = standardised(np.array([instance.features for instance in pool]))
    taken = different(table, lambda row: pool[row].is_worth_judging)
    if len(taken) < INSTANCES:
        raise NotFrozen(f"{definition.name}: only {len(taken)} instances of {len(pool)} of one structure")
    first = alike_part(table[taken], TUNING)
    order = [*first, *(row for row in range(INSTANCES) if row not in first)]
    return [pool[taken[row]] for row in order]


def different(table: FloatArray, is_worth: Callable[[int], bool]) -> list[int]:
    """``INSTANCES`` rows of a table of features (m, k), or fewer where no more are worth it.

    The first is the nearest to the mean; each other the farthest from all that were taken before.
    """
    taken: list[int] = []
    distance, left = -np.linalg.norm(table, axis=1), np.ones(len(table), dtype=bool)
    while len(taken) < INSTANCES and left.any():
        row = int(np.where(left, distance, -np.inf).argmax())
        left[row] = False
        if is_worth(row):
            apart = np.linalg.norm(table - table[row], axis=1)
            distance = np.minimum(distance, apart) if taken else apart
            taken.append(row)
    return taken


def frozen(definition: Definition, fine: Sequence[Tables] = ()) -> tuple[Description, bytes]:
    """A function and its file.

    Args:
        definition: of it.
        fine: the scenarios of its instances, where it has those of another function, or of an earlier suite.

    Raises:
        NotFrozen: there are not enough instances, or coarse ones of different structure.
    """
    instances = [instance_of(tables, definition) for tables in fine] if fine else chosen(definition)
    if len({instance.key for instance in instances}) > 1:
        raise NotFrozen(f"{definition.name}: its instances have different structures")
    first = instances[0]
    scenes = [instance.scenes() for instance in instances]
    corners = [instance.problem.bounds for instance in instances]
    sources = [structure.source for structure in first.structures]
    content = FunctionContent(
        kernels=tuple(SuiteKernel(s, program.values) for s, (program, _) in zip(sources, first.programs, strict=True)),
        numbers=tuple(np.array([scene[k][0] for scene in scenes]) for k in range(len(sources))),
        indices=tuple(np.array([scene[k][1] for scene in scenes]) for k in range(len(sources))),
        lower=np.array([lower for lower, _ in corners]),
        upper=np.array([upper for _, upper in corners]),
        bounds=np.array([[p.objective_upper_bound for p in each.problems] for each in instances]).T,
        scenarios=tuple(instance.tables for instance in instances),
    )
    written = content.written()
    description = Description(
        name=definition.name,
        group=definition.group,
        title=definition.title,
        form=definition.form,
        fine=definition.fine,
        dimension=len(first.problem.variables),
        variables=tuple(variable.name for variable in first.problem.variables),
        objectives=tuple((each.criteria.objective.name, each.criteria.objective.unit) for each in first.problems),
        constraints=first.programs[0][1],
        instances=len(instances),
        digest=sha256(written).hexdigest(),
        checks=tuple(checks_of(content)),
    )
    return description, written


def checks_of(content: FunctionContent) -> Iterator[str]:
    """Digests of the values at the check points of each instance."""
    for number, (lower, upper) in enumerate(zip(content.lower, content.upper, strict=True)):
        points = check_points(lower, upper)
        yield digest_of(np.hstack([content.values(k, number, points) for k in range(len(content.kernels))]))
