"""A problem of a suite as its users see it: values, the best known, motions.

Nothing here loads CasADi, unless a problem is asked for its motions, or a kernel has to be compiled.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tpbso_casadi.suite.adapters import adapted
from tpbso_casadi.suite.evaluation import FrozenProblem
from tpbso_casadi.suite.fronts import BestFront
from tpbso_casadi.suite.frozen import INVALID_FILE, InvalidSuite, folder_of
from tpbso_casadi.suite.kernels import FloatArray

if TYPE_CHECKING:
    from tpbso_casadi.suite.motions import SuiteMotion

BEST_KNOWN = "best_known.json"


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


@dataclass(frozen=True, eq=False, repr=False)
class SuiteProblem(FrozenProblem):
    """A frozen problem, with the best that is known of it, motions of its candidates, and other libraries.

    Attributes:
        suite: the name of the one that it comes from; later ones that share it keep the name.
        function: what is told of it.
        instance: from 1 on.
        threads: that share candidates, each at least 512.
    """

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
        return adapted(self, library)


@cache
def _known(suite: str) -> dict[str, Any]:
    path = folder_of(suite) / BEST_KNOWN
    try:
        known: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidSuite(f"{path}: {INVALID_FILE}") from error
    return known
