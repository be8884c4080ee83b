"""Names of robots, limits, objectives, tasks and solvers: built in, of a class by its path, of an entry point.

A :class:`Catalogue` describes one kind of thing (solvers, robots, ...) and finds its members. Every error is a
:class:`PluginError` of one line that says what is wrong and names the nearest known name.
"""

from __future__ import annotations

import reprlib
import sys
import traceback
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from functools import reduce
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Generic, TypeGuard, TypeVar

from problems import LIMITS, OBJECTIVES, ROBOTS, Limit, Objective, Robot
from problems.base import nearest_word
from problems.objectives import WeightedSum
from problems.robots import BUILT_IN
from solvers import EXTERNAL, GRADIENT_SOLVERS, IPOPT, SOLVERS, AdaptiveBeetleSwarm, AnySolver, is_solver_class

T = TypeVar("T")


class PluginError(ValueError):
    """A name that cannot be resolved; the message is one line."""


@dataclass(frozen=True, kw_only=True)
class Catalogue(Generic[T]):
    """All things of one kind that a user can name.

    Attributes:
        kind: what they are called in messages: "solver".
        group: name of the entry-point group: "tpbso_casadi.solvers".
        registry: by name, the thing itself, or its path "package.module:Attribute", imported when it is used.
        accepts: whether an object is of that kind, see :func:`subclass_of`.
        requirement: the same in words: "a subclass of solvers.Solver".
        extras: by name, the package that is needed, and the extra of this distribution that installs it; for those that
            need one.
        elsewhere: names that a user can give in the same place and that are not looked up here.
    """

    kind: str
    group: str
    registry: Mapping[str, T | str]
    accepts: Callable[[object], TypeGuard[T]]
    requirement: str
    extras: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    elsewhere: Collection[str] = ()

    def find(self, name: str) -> T:
        """The thing of that name.

        Args:
            name: in the registry, of an entry point, or "package.module:Attribute"; the first of these that fits.

        Raises:
            PluginError: there is none, it cannot be imported, it is of another kind, or it needs an extra package.
        """
        if name in self.registry:
            return self._registered(name)
        if ":" in name:
            return self._checked(name, self._load(name, name))
        entries = self._entries(name)
        if not entries:
            raise PluginError(f"no {self.kind} {name!r}; {_hint(name, [*self.names(), *self.elsewhere])}")
        if len({entry.value for entry in entries}) > 1:
            offers = " and ".join(sorted({entry.value for entry in entries}))
            raise PluginError(f"{self.kind} {name!r} is ambiguous: say {offers.replace(' and ', ' or ')}")
        return self._checked(name, self._load(name, entries[0].value))

    def names(self) -> list[str]:
        """All names, those of the registry first, then those of entry points."""
        offered = {entry.name for entry in entry_points(group=self.group)}
        return [*self.registry, *sorted(offered - set(self.registry))]

    def _entries(self, name: str) -> list[EntryPoint]:
        return list(entry_points(group=self.group, name=name))

    def _registered(self, name: str) -> T:
        package, extra = self.extras.get(name, ("", ""))
        if package and find_spec(package) is None:
            raise PluginError(f"{name} needs the package {package}: pip install 'tpbso-casadi[{extra}]'")
        entry = self.registry[name]
        return self._checked(name, self._load(name, entry) if isinstance(entry, str) else entry)

    def _load(self, name: str, path: str) -> object:
        """Import "package.module:Attribute"; exceptions of the module become one line."""
        module_name, _, attribute = path.partition(":")
        prefix = f"cannot load {self.kind} {name!r}"
        if not (module_name and attribute) or module_name.startswith("."):
            raise PluginError(f"{prefix}: {path!r} is not package.module:Attribute")
        try:
            with redirect_stdout(sys.stderr):  # standard output is for results
                module = import_module(module_name)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise PluginError(f"{prefix}: importing {module_name} failed: {_one_line(error)}") from error
        try:
            return reduce(getattr, attribute.split("."), module)
        except AttributeError as error:
            public = [known for known in vars(module) if not known.startswith("_")]
            raise PluginError(f"{prefix}: {module_name} has no {attribute}; {_hint(attribute, public)}") from error
        except (Exception, SystemExit) as error:
            raise PluginError(f"{prefix}: {attribute} of {module_name} failed: {_one_line(error)}") from error

    def _checked(self, name: str, candidate: object) -> T:
        if self.accepts(candidate):
            return candidate
        raise PluginError(f"{self.kind} {name!r} is not {self.requirement}")


def subclass_of(base: type[T] | tuple[type[T], ...]) -> Callable[[object], TypeGuard[type[T]]]:
    """A check for :class:`Catalogue`: a class derived from ``base``, or from one of several."""

    def accepts(candidate: object) -> TypeGuard[type[T]]:
        return isinstance(candidate, type) and issubclass(candidate, base)

    return accepts


def _hint(name: str, known: Iterable[str]) -> str:
    known = sorted(known)
    near = nearest_word(name, known, cutoff=0.4)
    return f"did you mean {near}?" if near else f"there are {', '.join(known) or 'none'}"


def failure(error: BaseException) -> str:
    """The exception of a plug-in, and where it was raised, in one line."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{_one_line(error)} ({Path(where.filename).name}:{where.lineno})"


def is_raised_in(plugins: Sequence[str], error: BaseException) -> bool:
    """Whether the code of a plug-in that is named by its path was running when an error was raised."""
    modules = [sys.modules.get(name.partition(":")[0]) for name in plugins if ":" in name]
    files = {getattr(module, "__file__", None) for module in modules} - {None}
    return any(frame.filename in files for frame in traceback.extract_tb(error.__traceback__))


def _one_line(error: BaseException) -> str:
    try:
        reason = " ".join(str(error).split())
    except Exception:  # an exception of a plug-in may raise one itself
        reason = ""
    return f"{type(error).__name__}: {reason}"


ROBOT_CATALOGUE: Catalogue[type[Robot]] = Catalogue(
    kind="robot",
    group="tpbso_casadi.robots",
    registry=ROBOTS,
    accepts=subclass_of(Robot),
    requirement="a subclass of problems.Robot",
    elsewhere=BUILT_IN,
)
LIMIT_CATALOGUE: Catalogue[type[Limit]] = Catalogue(
    kind="limit",
    group="tpbso_casadi.limits",
    registry=LIMITS,
    accepts=subclass_of(Limit),
    requirement="a subclass of problems.Limit",
)
OBJECTIVE_CATALOGUE: Catalogue[type[Objective]] = Catalogue(
    kind="objective",
    group="tpbso_casadi.objectives",
    registry={name: type(objective) for name, objective in OBJECTIVES.items()},
    accepts=subclass_of(Objective),
    requirement="a subclass of problems.Objective",
)


def _is_solver(candidate: object) -> TypeGuard[type[AnySolver]]:
    return is_solver_class(candidate) or subclass_of(IPOPT)(candidate)


DIRECT = "direct"  # plans motions without a search; what it finds none for is searched by the adaptive beetle swarm
FORMER_NAMES = {"ladder": DIRECT}

SOLVER_CATALOGUE: Catalogue[type[AnySolver]] = Catalogue(
    kind="solver",
    group="tpbso_casadi.solvers",
    registry={
        **{DIRECT: AdaptiveBeetleSwarm, **SOLVERS, **GRADIENT_SOLVERS},
        **{name: external.path for name, external in EXTERNAL.items()},
    },
    accepts=_is_solver,
    requirement="a dataclass derived from solvers.Solver",
    extras={name: (external.package, external.extra) for name, external in EXTERNAL.items() if external.package},
)


NONE: Mapping[str, Objective] = {}


def find_objective(chosen: str | Mapping[str, float], own: Mapping[str, Objective] = NONE) -> Objective:
    """The objective of a name; of a table of weights the weighted sum, or the one that alone has weight 1.

    Args:
        chosen: the name, or weights by name.
        own: those that a scenario states itself, by name.

    Raises:
        PluginError: there is none of a name, or it is of another kind.
        InvalidProblem: two names stand for the same objective.
    """
    if isinstance(chosen, str):
        return own[chosen] if chosen in own else OBJECTIVE_CATALOGUE.find(chosen)()
    found = tuple(find_objective(name, own) for name in chosen)
    weights = tuple(chosen.values())
    return found[0] if weights == (1.0,) else WeightedSum(weights, found)


def find_solver(name: str) -> type[AnySolver]:
    """The class of a solver.

    Args:
        name: of a solver of ours (of ``direct`` the one that searches what is left) or of another library, in the
            entry-point group ``tpbso_casadi.solvers``, or ``package.module:Class``.

    Raises:
        PluginError: nothing of that name, it is not a :class:`solvers.Solver`, or its library is not installed.
    """
    if not isinstance(name, str):
        raise PluginError(f"solver: a name is needed, not {reprlib.repr(name)}")
    return SOLVER_CATALOGUE.find(current_name(name))


def current_name(solver: str) -> str:
    """The name that a solver has now, where it had another one."""
    return FORMER_NAMES.get(solver, solver)
