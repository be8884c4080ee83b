"""A suite as its users see it: a sequence of problems, which are boxes of numbers with values.

Nothing here loads CasADi, unless a problem is asked for its motions, or a kernel has to be compiled.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import inf
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from tpbso_casadi.suite.fronts import BestFront
from tpbso_casadi.suite.frozen import (
    INVALID_FILE,
    SUITE,
    Description,
    FunctionContent,
    InvalidSuite,
    check_points,
    content_of,
    descriptions,
    digest_of,
    folder_of,
    with_frozen_spheres,
)
from tpbso_casadi.suite.kernels import FloatArray, NoCompiler

if TYPE_CHECKING:
    from tpbso_casadi.scenario import Scenario
    from tpbso_casadi.suite.motions import SuiteMotion

BEST_KNOWN = "best_known.json"
MOST_THREADS = 256


class Values(NamedTuple):
    """All that is computed of m candidates, at once.

    Attributes:
        merit: one number to minimise, (m,): the objective where all constraints hold, more than the bound where not;
            of two objectives (m, 2).
        objectives: (m, 1) or (m, 2), whether constraints hold or not.
        violations: (m, c), 0 where a constraint holds, else how much of it is broken in all, without a unit.
    """

    merit: FloatArray
    objectives: FloatArray
    violations: FloatArray


@dataclass(frozen=True, kw_only=True)
class BestKnown:
    """The best candidate that is known of a problem.

    Attributes:
        value: its merit, of which all constraints hold at the samples.
        x: itself, (d,).
        certified: whether its motion, slowed by the least factor with which limits hold between samples too, is proven
            to keep all limits for all t.
        motion_value: the objective of that motion, exact.
        ways: by the name of a way to search, how many of its runs came within 0.01 % of the value, and how many it had.
        descended_value: the objective of the best certified motion that IPOPT descended to on the smooth program of the
            same task, whose motions need not be motions of candidates; None where it found none, or did not try.
    """

    value: float
    x: FloatArray
    certified: bool
    motion_value: float
    ways: dict[str, tuple[int, int]]
    descended_value: float | None


@dataclass(frozen=True, eq=False)
class SuiteProblem:
    """One instance of one function.

    Attributes:
        suite: the name of the one that it comes from; later ones that share it keep the name.
        function: what is told of it.
        instance: from 1 on.
        threads: that share candidates, each at least 512.
    """

    suite: str
    function: Description
    instance: int
    threads: int = 1

    def __repr__(self) -> str:
        return f"<{self.name}: {self.function.title}, {self.dimension} variables>"

    @property
    def name(self) -> str:
        """The name of the problem, as ``arm-motions-1/spline-3@1``."""
        return f"{self.suite}/{self._key}"

    @property
    def group(self) -> str:
        """The group of functions that are judged together."""
        return self.function.group

    @property
    def form(self) -> str:
        """``penalised``, ``constrained`` or ``two objectives``."""
        return self.function.form

    @property
    def dimension(self) -> int:
        """Number of variables, d."""
        return self.function.dimension

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return self.function.variables

    @property
    def objectives(self) -> tuple[tuple[str, str], ...]:
        """Names and units of the objectives."""
        return self.function.objectives

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Names of the columns of :meth:`constraints`."""
        return self.function.constraints

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the search box, both (d,)."""
        return self._content.lower[self.instance - 1], self._content.upper[self.instance - 1]

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (..., d) are in the box, (...); no point with a NaN is."""
        lower, upper = self.bounds
        return np.asarray(((points >= lower) & (points <= upper)).all(axis=-1))

    @property
    def feasible_merit(self) -> float:
        """The merit up to which all constraints hold; of two objectives that of the first."""
        return float(self._content.bounds[0, self.instance - 1])

    def evaluate(self, candidates: FloatArray) -> FloatArray:
        """Values to be minimised, (m,) of candidates (m, d); of two objectives (m, 2).

        The merit where the form is ``penalised``; else the objective alone, beside :meth:`constraints`.

        Raises:
            ValueError: of another shape.
        """
        found = self.values(candidates)
        if self.form == "penalised":
            return found.merit
        return found.objectives[:, 0] if len(self.objectives) == 1 else found.objectives

    def constraints(self, candidates: FloatArray) -> FloatArray:
        """Violations (m, c) of candidates (m, d): 0 where a constraint holds at all samples, else more.

        Raises:
            ValueError: of another shape.
        """
        return self.values(candidates).violations

    def merit(self, candidates: FloatArray) -> FloatArray:
        """One number (m,) for each of candidates (m, d), whatever the form: feasibility first, then the objective.

        Raises:
            ValueError: of another shape.
        """
        return self.values(candidates).merit

    def values(self, candidates: FloatArray) -> Values:
        """Everything of candidates (m, d), in one evaluation; infinite where one is not in the box.

        Raises:
            ValueError: of another shape.
        """
        points = np.ascontiguousarray(candidates, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != self.dimension:
            raise ValueError(f"{self.name}: candidates of shape {points.shape} where (m, {self.dimension}) is needed")
        columns = [self._columns(kernel, points) for kernel in range(len(self.objectives))]
        is_outside = ~self.contains(points)
        if is_outside.any():
            for each in columns:
                each[is_outside] = inf
        merit, objectives = (np.stack([each[:, k] for each in columns], axis=1) for k in range(2))
        return Values(merit[:, 0] if len(columns) == 1 else merit, objectives, columns[0][:, 2:])

    def _columns(self, kernel: int, points: FloatArray) -> FloatArray:
        """Merit, objective and violations (m, k): by compiled code, or interpreted where there is none."""
        try:
            return self._content.values(kernel, self.instance - 1, points, self.threads)
        except NoCompiler:
            return self._interpreted[kernel](points)

    @cached_property
    def _interpreted(self) -> list[Callable[[FloatArray], FloatArray]]:
        """The functions of the model itself, if they still give the bits of the suite."""
        from tpbso_casadi.suite.motions import interpreted  # noqa: PLC0415 (CasADi)

        functions = interpreted(self.scenario, self.form, self.suite)
        points = check_points(*self.bounds)
        if digest_of(np.hstack([function(points) for function in functions])) != self._check:
            raise InvalidSuite(f"{self.name}: without a C++ compiler this version does not give the suite's values")
        return functions

    def is_intact(self) -> bool:
        """Whether this machine gives the bits with which the suite was frozen."""
        return digest_of(np.hstack(self.check_values)) == self._check

    @property
    def check_values(self) -> list[FloatArray]:
        """Merit, objective and violations at points of the box that are the same on every machine, by objective."""
        points = check_points(*self.bounds)
        return [self._columns(kernel, points) for kernel in range(len(self.objectives))]

    @property
    def _check(self) -> str:
        return self.function.checks[self.instance - 1]

    @cached_property
    def best_known(self) -> BestKnown | None:
        """The best candidate that is known; None where nobody looked, or there are two objectives."""
        stored = _known(self.suite).get(self._key, {}).get("best")
        if stored is None:
            return None
        ways = {way: (hits, runs) for way, (hits, runs) in stored["ways"].items()}
        return BestKnown(**{**stored, "x": np.array(stored["x"]), "ways": ways})

    @cached_property
    def best_front(self) -> BestFront | None:
        """The best front that is known; None where nobody looked, or there is one objective."""
        stored = _known(self.suite).get(self._key, {}).get("front")
        if stored is None:
            return None
        arrays = {key: np.array(stored[key]) for key in ("ideal", "nadir", "x", "values")}
        return BestFront(**{**stored, **arrays})

    @property
    def best_merit(self) -> float | None:
        """The lowest merit that is known of a run, 0 where a front is known; None where nothing is."""
        if self.best_front is not None:
            return 0.0
        return None if self.best_known is None else self.best_known.value

    @property
    def lower_bound(self) -> float | None:
        """A bound below the objectives of all motions that keep all limits for all t; None where nothing is known.

        Of a candidate the samples alone count, so that a value may be lower by what happens between them.
        """
        bound: float | None = _known(self.suite).get(self._key, {}).get("lower_bound")
        return bound

    @property
    def _key(self) -> str:
        return f"{self.function.name}@{self.instance}"

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario that it was made of."""
        from tpbso_casadi.scenario import parse_scenario  # noqa: PLC0415 (CasADi)

        return parse_scenario(with_frozen_spheres(self.suite, self._content.scenarios[self.instance - 1]))

    def decode(self, x: FloatArray) -> SuiteMotion:
        """The motion of a candidate (d,), slowed by the least factor with which its limits hold between samples too.

        Raises:
            ValueError: of another shape, or not in the box.
        """
        from tpbso_casadi.suite.motions import motion  # noqa: PLC0415 (CasADi)

        point = np.asarray(x, dtype=np.float64)
        if point.shape != (self.dimension,):
            raise ValueError(f"{self.name}: x of shape {point.shape} where ({self.dimension},) is needed")
        if not self.contains(point):
            raise ValueError(f"{self.name}: x is not in the box")
        return motion(self.scenario, point, self.suite, self.name)

    def certify(self, x: FloatArray) -> bool:
        """Whether the motion of a candidate (d,) is proven to keep all limits for all t; :meth:`decode` says which.

        Raises:
            ValueError: of another shape, or not in the box.
        """
        return self.decode(x).certified

    def to(self, library: str) -> Any:
        """The problem as another library has its problems: ``ioh``, ``nevergrad``, ``pygmo``, ``pymoo``, ``scipy``.

        Raises:
            InvalidSuite: there is no such adapter, the library is missing, or it has no problems of this form.
        """
        from tpbso_casadi.suite.adapters import adapted  # noqa: PLC0415 (other libraries)

        return adapted(self, library)

    @property
    def _content(self) -> FunctionContent:
        return content_of(self.suite, self.function.name, self.function.digest)


@cache
def _known(suite: str) -> dict[str, Any]:
    path = folder_of(suite) / BEST_KNOWN
    try:
        known: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidSuite(f"{path}: {INVALID_FILE}") from error
    return known


@dataclass(frozen=True, eq=False, repr=False)
class Suite:
    """A sequence of problems: all instances of a function, then those of the next.

    Attributes:
        name: of the suite.
        problems: of it, all or some.
    """

    name: str
    problems: tuple[SuiteProblem, ...]

    def __repr__(self) -> str:
        return f"<suite {self.name}: {len(self)} problems of {len(self.functions)} functions>"

    @overload
    def __getitem__(self, which: int | str) -> SuiteProblem: ...
    @overload
    def __getitem__(self, which: slice) -> Suite: ...
    def __getitem__(self, which: int | str | slice) -> SuiteProblem | Suite:
        """A problem by its place or its name, ``spline-3@1``; or some of them.

        Raises:
            InvalidSuite: there is none of that name.
        """
        if isinstance(which, slice):
            return Suite(self.name, self.problems[which])
        if not isinstance(which, str):
            return self.problems[which]
        key = which.removeprefix(f"{self.name}/")
        found = next((each for each in self.problems if each.name in (key, f"{each.suite}/{key}")), None)
        if found is None:
            from problems.base import nearest_word  # noqa: PLC0415 (CasADi; for a mistake alone)

            names = {problem._key: problem.name for problem in self.problems}
            near = nearest_word(key.rpartition("/")[2], [*names], cutoff=0.0)
            raise InvalidSuite(f"there is no problem {which!r:.80} in {self!r}; did you mean {names.get(near or '')}?")
        return found

    def __len__(self) -> int:
        return len(self.problems)

    def __iter__(self) -> Iterator[SuiteProblem]:
        return iter(self.problems)

    @property
    def functions(self) -> tuple[Description, ...]:
        """The functions of which the problems are instances."""
        return tuple(dict.fromkeys(problem.function for problem in self.problems))

    def export(self, folder: str | Path) -> Path:
        """Write the problems as C++ with a header of C, which ``make`` builds a library of, for other languages.

        Args:
            folder: new or empty.

        Returns:
            The path of the folder.

        Raises:
            OutputError: it holds something, or cannot be written.
            InvalidSuite: this machine does not give the suite's values.
        """
        from tpbso_casadi.suite.c_sources import write_c  # noqa: PLC0415 (CasADi)

        write_c(Path(folder), self.problems)
        return Path(folder)


def suite(
    name: str | None = None,
    functions: Sequence[str] | None = None,
    instances: Sequence[int] | None = None,
    threads: int = 1,
    *,
    version: int | None = None,
) -> Suite:
    """A suite of problems to judge solvers by.

    Args:
        name: of the suite; ``arm-motions-1`` where None.
        functions: names of functions or of groups of them; all where None.
        instances: from 1 on; all where None.
        threads: that share the candidates of an evaluation, each at least 512; values have the same bits.
        version: in place of the name: 2 for ``arm-motions-2``.

    Raises:
        InvalidSuite: there is no such suite, function or instance, not even one thread, or more than 256.
        TypeError: the name is no text, the threads or the version are no whole number, there are both a name and a
            version, or the others are no lists of names and of whole numbers.
    """
    name = _name_of(name, version)
    for argument, value, kind in (("functions", functions, str), ("instances", instances, int)):
        if value is not None and not _are(value, kind):
            raise TypeError(f"{argument}: a list of {'names' if kind is str else 'whole numbers'} is needed")
    _check_whole("threads", threads)
    if not 1 <= threads <= MOST_THREADS:
        raise InvalidSuite(f"threads: {threads!r:.60} is not within 1 and {MOST_THREADS}")
    known = descriptions(name)
    wanted = {*(functions or ())}
    chosen = [(owner, each) for owner, each in known if functions is None or {each.name, each.group} & wanted]
    foreign = wanted - {each.name for _, each in known} - {each.group for _, each in known}
    if foreign:
        from problems.base import nearest_word  # noqa: PLC0415 (CasADi; for a mistake alone)

        groups = list(dict.fromkeys(each.group for _, each in known))
        near = nearest_word(min(foreign), [*groups, *(each.name for _, each in known)])
        hint = f"did you mean {near}?" if near else f"the groups are {', '.join(groups)}"
        raise InvalidSuite(f"{name}: no function or group {min(foreign)!r:.60}; {hint}")
    most = min(each.instances for _, each in known)
    numbers = range(1, most + 1) if instances is None else instances
    wrong = next((number for number in numbers if not 1 <= number <= most), None)
    if wrong is not None:
        raise InvalidSuite(f"{name}: no instance {wrong}; they are 1 to {most}")
    each_problem = ((owner, each, number) for owner, each in chosen for number in numbers)
    return Suite(name, tuple(SuiteProblem(*which, threads=int(threads)) for which in each_problem))


def _name_of(name: str | None, version: int | None) -> str:
    """The name of the suite that is asked for; the default where nothing is said."""
    if version is not None:
        _check_whole("version", version)
        if name is not None:
            raise TypeError("name and version: one of them says which suite")
        return f"{SUITE.rpartition('-')[0]}-{version}"
    if name is None:
        return SUITE
    if not isinstance(name, str):
        raise TypeError("name: that of a suite is needed")
    return name


def _check_whole(argument: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise TypeError(f"{argument}: a whole number is needed")


def _are(values: object, kind: type) -> bool:
    """Whether these are a sequence of such values, and not one text."""
    is_sequence = isinstance(values, Sequence) and not isinstance(values, str | bytes)
    return is_sequence and all(isinstance(value, kind) and not isinstance(value, bool) for value in values)  # type: ignore[attr-defined]


@cache
def problem_named(name: str) -> SuiteProblem:
    """A problem by its whole name, ``arm-motions-1/spline-3@1``.

    Raises:
        InvalidSuite: there is none.
    """
    owner, slash, rest = name.partition("/")
    if not slash:
        raise InvalidSuite(f"{name!r:.80} is no problem such as {SUITE}/spline-3@1")
    return suite(owner)[rest]
