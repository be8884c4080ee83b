"""Ask and tell: a search whose caller evaluates; saved and loaded bit for bit."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np

from solvers.budget import Budget, Interruption, StopReason
from solvers.driver import Result, SearchRun, Status
from solvers.solver import FloatArray, SearchBox, Solver
from solvers.standalone import Bounds, SolverChoice, box_of, budget_of, candidates_of, generator_of, solver_of

FORMAT = 1


@dataclass
class Record:
    """The statement of a search, and the costs that it was given.

    Attributes:
        path: "module:Class" of the solver.
        settings: of the solver.
        box: with the known candidates.
        budget: of the search.
        seed: of the search.
        costs: told so far, one (m,) for each batch.
        stored_digest: of the candidates, as read from a file.
    """

    path: str
    settings: dict[str, Any]
    box: SearchBox
    budget: Budget
    seed: int
    costs: list[FloatArray] = field(default_factory=list)
    stored_digest: str = ""

    def __post_init__(self) -> None:
        self._candidates = sha256()

    @classmethod
    def of(cls, solver: Solver, box: SearchBox, budget: Budget, seed: int) -> Self:
        """The record of a search that was given no cost yet."""
        kind = type(solver)
        settings = asdict(solver)  # type: ignore[call-overload]  # all are dataclasses
        return cls(f"{kind.__module__}:{kind.__qualname__}", settings, box, budget, seed)

    def add(self, candidates: FloatArray, costs: FloatArray) -> None:
        """Add the costs (m,) of candidates (m, d)."""
        self._candidates.update(candidates.tobytes())
        self.costs.append(costs.copy())

    def digest(self) -> str:
        """A digest of all candidates so far."""
        return self._candidates.hexdigest()

    def solver(self) -> Solver:
        """The solver that was recorded."""
        return solver_of(self.path, self.settings)


def write_record(record: Record, file: Path) -> Path:
    """Write a record as a NumPy archive without pickled objects.

    Raises:
        ValueError: the search cannot be repeated.
        OSError: the file cannot be written.
    """
    if record.budget.seconds is not None:
        raise ValueError("save: a budget of seconds depends on the clock and cannot be repeated; say evaluations")
    if isinstance(record.seed, bool) or not isinstance(record.seed, int | np.integer):
        raise ValueError("save: a search with a generator for its seed cannot be repeated; say a number")
    stated = {
        "format": FORMAT,
        "solver": record.path,
        "settings": record.settings,
        "budget": asdict(record.budget),
        "seed": int(record.seed),
        "digest": record.digest(),
    }
    box = record.box
    known = np.empty((0, box.dimension)) if box.known is None else box.known
    with file.open("wb") as opened:
        np.savez(
            opened,
            stated=np.array(json.dumps(stated)),
            bounds=np.stack([box.lower, box.upper]),
            known=known,
            sizes=np.array([len(costs) for costs in record.costs], dtype=np.int64),
            costs=np.concatenate([*record.costs, np.empty(0)]),
        )
    return file


def read_record(file: Path) -> Record:
    """The record of a file.

    Raises:
        ValueError: it is none.
        OSError: it cannot be read.
    """
    try:
        with file.open("rb") as opened, np.load(opened, allow_pickle=False) as archive:
            stated = json.loads(str(archive["stated"]))
            sizes, costs, known = archive["sizes"], archive["costs"], archive["known"]
            if stated["format"] != FORMAT or sizes.sum() != len(costs):
                raise ValueError("of another format")
            if costs.dtype != np.float64 or costs.ndim != 1 or not isinstance(stated["settings"], dict):
                raise ValueError("its costs or its settings are of another kind")
            box = SearchBox(*archive["bounds"]).with_known(known if len(known) else None)
            told = np.split(costs, np.cumsum(sizes)[:-1]) if len(sizes) else []
            budget = Budget(**stated["budget"])
        return Record(stated["solver"], stated["settings"], box, budget, stated["seed"], told, stated["digest"])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, zipfile.BadZipFile, EOFError) as error:
        raise ValueError(f"{file}: not a saved search: {error}") from error


class AskTell:
    """A search whose candidates the caller evaluates.

    The candidates are those of :func:`minimize` with the same arguments. ::

        search = tp.AskTell("abso", [(-5, 5)] * 10, budget=5_000, seed=1)
        while not search.done:
            candidates = search.ask()
            search.tell(candidates, costs_of(candidates))
        print(search.result)

    Args:
        solver: a name, a class or an object, as for :func:`minimize`.
        bounds: one ``(low, high)`` a variable, or an array (2, d).
        budget: evaluations, or a :class:`Budget`. Its seconds run from here on, the caller's own included.
        seed: same seed, and same costs, same candidates.
        known: good candidates (m, d) or (d,), asked for first.
        settings: hyper-parameters of the solver by name.

    Raises:
        ValueError: as :func:`minimize` does.
        TypeError: likewise.
    """

    def __init__(
        self,
        solver: SolverChoice,
        bounds: Bounds,
        *,
        budget: Budget | int = 10_000,
        seed: int = 1,
        known: Any = None,
        **settings: Any,
    ) -> None:
        self.solver, self.budget, self.seed = solver_of(solver, settings), budget_of(budget), seed
        self.box = candidates_of(known, box_of(bounds))
        self._run = SearchRun(self.solver, self.box, self.budget, generator_of(seed), Interruption())
        self._asked = False
        self._record = Record.of(self.solver, self.box, self.budget, seed)

    def __repr__(self) -> str:
        state = self.stop_reason.value if self.stop_reason is not None else "running"
        status = self._run.status
        return f"AskTell({self.solver!r}, {status.evaluations} evaluations, cost={status.cost:.6g}, {state})"

    @property
    def done(self) -> bool:
        """Whether the search has ended."""
        return self._run.pending is None

    @property
    def stop_reason(self) -> StopReason | None:
        """The criterion that ended it; None while it runs."""
        return self._run.stop_reason if self.done else None

    @property
    def status(self) -> Status:
        """The state of the search: evaluations, iterations, the lowest cost."""
        return self._run.status

    @property
    def result(self) -> Result:
        """The result of a search that has ended.

        Raises:
            RuntimeError: the search has not ended; :meth:`stop` ends it.
        """
        if not self.done:
            raise RuntimeError("result: the search has not ended; go on asking and telling, or stop() it")
        return self._run.result(self.seed)

    def ask(self) -> FloatArray:
        """The candidates (m, d) to be evaluated now; the same ones until they are told.

        Raises:
            RuntimeError: the search has ended.
        """
        if self._run.pending is None:
            raise RuntimeError(f"ask: the search has ended ({self._run.stop_reason}); see done and result")
        self._asked = True
        return self._run.pending.copy()

    def tell(self, candidates: Any, costs: Any) -> None:
        """Take the costs (m,) of the candidates (m, d) that were asked for, in their order.

        NaN and infinite costs count as worst: no candidate with one becomes the best.

        Raises:
            RuntimeError: nothing was asked for, or the search has ended.
            ValueError: other candidates, or not one cost for each; the search can go on with the right ones.
            BaseException: whatever the solver raises, also of what it then asks for; that ends the search, and
                :attr:`result` has the best of what was told.
        """
        pending = self._run.pending
        if pending is None:
            raise RuntimeError(f"tell: the search has ended ({self._run.stop_reason})")
        if not self._asked:
            raise RuntimeError("tell: nothing was asked for; ask() first")
        if not np.array_equal(_array("candidates", candidates), pending):
            raise ValueError(f"tell: these are not the {len(pending)} candidates that ask() gave, in its order")
        values = _array("costs", costs)
        if values.shape != (len(pending),):
            raise ValueError(f"tell: costs of shape {values.shape} for {len(pending)} candidates; ({len(pending)},)")
        self._take(values)

    def _take(self, values: FloatArray) -> None:
        assert self._run.pending is not None
        self._record.add(self._run.pending, values)
        self._asked = False
        try:
            self._run.tell(values)
            while self._run.pending is not None and not len(self._run.pending):
                self._run.tell(np.empty(0))  # the budget is spent: the search ends with this
        except BaseException:  # of the solver
            self._run.fail()
            raise

    def stop(self) -> None:
        """End the search before its budget is spent; the reason is ``StopReason.INTERRUPTED``.

        Raises:
            RuntimeError: no cost was told yet.
        """
        if not self._record.costs:
            raise RuntimeError("stop: no cost was told yet, so there is no result")
        if not self.done:
            self._run.stop(StopReason.INTERRUPTED)

    def save(self, file: str | Path) -> Path:
        """Write the search and its costs so far to a file, from which :meth:`load` continues it.

        Raises:
            ValueError: it cannot be repeated: its budget has seconds, or its seed is a generator.
            OSError: the file cannot be written.
        """
        return write_record(self._record, Path(file))

    @classmethod
    def load(cls, file: str | Path) -> Self:
        """A saved search, bit for bit as it was; its candidates are computed again and checked.

        Raises:
            ValueError: not such a file, or other versions lead to other candidates.
            OSError: it cannot be read.
        """
        record = read_record(Path(file))
        try:
            search = cls(record.solver(), record.box, budget=record.budget, seed=record.seed)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{file}: not a saved search: {error}") from error
        for costs in record.costs:
            if search.done or len(costs) != len(search.ask()):
                raise ValueError(f"{file}: the search takes another course here; versions or the solver have changed")
            search._take(costs)
        if search._record.digest() != record.stored_digest:
            raise ValueError(f"{file}: the search asks for other candidates here; versions or the solver have changed")
        return search


def _array(name: str, values: Any) -> FloatArray:
    try:
        table = np.asarray(values)
        if table.dtype.kind == "c":
            raise ValueError("complex")
        return table.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"tell: {name} are {values!r:.60} where real numbers are needed") from error
