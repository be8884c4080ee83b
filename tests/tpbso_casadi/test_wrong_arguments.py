"""What no public name is made for is refused by us: an error that we raise, none that Python or NumPy stumbles on."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import EnumType
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp

HUGE = 10**400
SILLY: list[Any] = [
    None, True, -1, 0, 5, HUGE, float("nan"), float("inf"), "nope", "", b"x", object(), [], (), {}, {1: 2}, [None],
    [1, 2], [[1], [2, 3]], ["a"], np.array([]), np.array([[np.nan]]), np.array(["x"]), 1j, print, int, tp, set(),
]  # fmt: skip
WRONG: list[Any] = [object(), {1: 2}, 1j, HUGE, [None], b"x"]  # as any argument
ROOT = Path(tp.__file__).parent.parent
PYTHONS_OWN = "missing", "positional argument", "unexpected keyword", "abstract class", "Protocols cannot"

ARM = tp.robot([1.0, 1.0], max_speed=2.0, max_acceleration=10.0)
MOVE: dict[str, Any] = {"start": [1.0, 0.5], "goal": [0.5, 1.2], "evaluations": 40, "solver": "pso"}
WAY = np.array([[0.0, 0.0], [0.5, 0.2]])
SIMULATED = str(ROOT / "examples" / "simulation-plane.toml")
CALLS: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
    "plan": ((ARM,), MOVE | dict.fromkeys(("via", "obstacles", "limits", "seed", "elbow", "objective", "samples"))),
    "retime": ((WAY, ARM), {}),
    "compare": ((["time-2"], ["pso"]), {"runs": 1, "evaluations": 40}),
    "minimize": ((lambda x: float(x @ x), [(-1.0, 1.0)]), {"evaluations": 50}),
    "AskTell": (([(-1.0, 1.0)],), {}),
    "pareto": ((ARM,), MOVE | {"points": 2}),
    "simulate": ((SIMULATED,), {"seconds": 0.2, "evaluations": 20}),
    "robot": (([1.0, 1.0],), {"max_speed": 2.0, "max_acceleration": 10.0}),
    "Replanner": ((tp.builtin("time-2"),), {}),
}


@contextmanager
def raised_by_us(said: str) -> Iterator[None]:
    """Nothing is raised, or what is raised is by a statement of ours; Python may say that arguments are missing."""
    try:
        yield
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)[1:]
        is_ours = frames and Path(frames[-1].filename).is_relative_to(ROOT) and "raise" in (frames[-1].line or "")
        is_of_python = isinstance(error, TypeError) and any(words in str(error) for words in PYTHONS_OWN)
        assert is_ours or is_of_python, f"{said}: {error!r}"


def required(thing: Callable[..., Any]) -> tuple[int, list[str]]:
    """How many arguments a call has to have by their places, and which by their names."""
    parameters = [each for each in inspect.signature(thing).parameters.values() if each.default is each.empty]
    by_place = [each for each in parameters if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD)]
    return len(by_place), [each.name for each in parameters if each.kind is each.KEYWORD_ONLY]


def test_every_public_name_with_silly_arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    seen = 0
    for name in tp.__all__:
        thing = getattr(tp, name)
        is_model = isinstance(thing, type) and issubclass(thing, Exception)
        if not (inspect.isfunction(thing) or isinstance(thing, type)) or isinstance(thing, EnumType) or is_model:
            continue
        count, names = required(thing)
        for value in SILLY:
            with raised_by_us(f"{name}({value!r:.40})"):
                thing(*[value] * count, **dict.fromkeys(names, value))
            seen += 1
    assert seen > 1000


@pytest.mark.parametrize("name", CALLS)
def test_every_argument_of_what_does_the_work(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    thing, (places, keywords) = getattr(tp, name), CALLS[name]
    known = inspect.signature(thing).parameters
    stated = [key for key in (*known, *keywords) if key not in {"keys", "progress", "told", "evaluation"}]
    for key in dict.fromkeys(stated):
        for value in WRONG:
            place = list(known).index(key) if key in known else len(places)
            changed = (*places[:place], value, *places[place + 1 :]) if place < len(places) else places
            rest = keywords if place < len(places) else keywords | {key: value}
            with raised_by_us(f"{name}({key}={value!r:.40})"):
                thing(*changed, **rest)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: tp.builtin("tiem-2"), "no built-in scenario 'tiem-2'; did you mean time-2?"),
        (lambda: tp.MovingObstacle(1, 2), "still: an Obstacle is needed, not 1"),
        (lambda: tp.SearchBox(1, 2), "corners of shapes () and () where two (d,) are needed"),
        (lambda: tp.Replanner("x"), "scenario: a Scenario is needed, not 'x'"),
        (lambda: tp.Box(center=(1.0, 1.0), size=(0.1, 0.2, 0.1)), "center: 3 numbers are needed, not (1.0, 1.0)"),
        (lambda: tp.Tabulated.through([0.0, 1.0], np.zeros((3, 2))), "motion: times (n,) and positions (n, 2)"),
        (lambda: tp.Tabulated.along_lines([0.0, 0.0], np.zeros((2, 2))), "motion: row 2: times have to increase"),
        (lambda: tp.retime(HUGE, ARM), "path: waypoints (n, k), a path, a plan, a file or a folder is needed"),
        (lambda: tp.retime(WAY, ARM, limits=5), "limits: kinds of limits are needed, not 5"),
        (lambda: tp.compare(["time-2"], solvers=5), "solvers: solvers are needed, not 5"),
        (lambda: tp.compare("time-2", {1: 2}), "solver: 2 is none"),
        (lambda: tp.minimize(lambda x: 0.0, HUGE), "bounds: one (low, high) a variable is needed"),
        (lambda: tp.find_solver(5), "solver: a name is needed, not 5"),
        (lambda: tp.Iterations(5), "progress: shares of the budget are needed, not 5"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(make: Callable[[], object], said: str) -> None:
    with pytest.raises((ValueError, TypeError)) as refused:
        make()
    assert str(refused.value).startswith(said)


def test_lists_and_arrays_are_what_tuples_are() -> None:
    made = [tp.Ellipse(kind([1, 0.5]), kind([0.2, 0.1])) for kind in (tuple, list, np.array)]
    assert made[0] == made[1] == made[2] and hash(made[0]) == hash(made[2])
    assert tp.Box(center=np.zeros(3), size=[1, 1, 1]).size == (1.0, 1.0, 1.0)
