"""A suite: a sequence of problems, and how some of them are chosen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import overload

from tpbso_casadi.suite.frozen import SUITE, Description, InvalidSuite, descriptions
from tpbso_casadi.suite.problem import SuiteProblem

MOST_THREADS = 256


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
