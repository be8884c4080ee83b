"""A search with the costs that it was told, from which it can be repeated: a running one cannot be pickled."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np

from solvers.box import Box, FloatArray
from solvers.driver.budget import Budget
from solvers.solver import Solver
from solvers.standalone.statement import solver_of

FORMAT = 1


@dataclass
class Record:
    """How a search was stated, and what it was told.

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
    box: Box
    budget: Budget
    seed: int
    costs: list[FloatArray] = field(default_factory=list)
    stored_digest: str = ""

    def __post_init__(self) -> None:
        self._candidates = sha256()

    @classmethod
    def of(cls, solver: Solver, box: Box, budget: Budget, seed: int) -> Self:
        """The record of a search to which nothing was told yet."""
        kind = type(solver)
        settings = asdict(solver)  # type: ignore[call-overload]  # all are dataclasses
        return cls(f"{kind.__module__}:{kind.__qualname__}", settings, box, budget, seed)

    def add(self, candidates: FloatArray, costs: FloatArray) -> None:
        """The costs (m,) of candidates (m, d)."""
        self._candidates.update(candidates.tobytes())
        self.costs.append(costs.copy())

    def digest(self) -> str:
        """Of all candidates so far."""
        return self._candidates.hexdigest()

    def solver(self) -> Solver:
        """As it was."""
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
            box = Box(*archive["bounds"]).with_known(known if len(known) else None)
            told = np.split(costs, np.cumsum(sizes)[:-1]) if len(sizes) else []
            budget = Budget(**stated["budget"])
        return Record(stated["solver"], stated["settings"], box, budget, stated["seed"], told, stated["digest"])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, zipfile.BadZipFile, EOFError) as error:
        raise ValueError(f"{file}: not a saved search: {error}") from error
