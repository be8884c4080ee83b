"""The suite: what it holds, the bits of its values, what is known of its problems, what stands behind the numbers."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.evaluation import needs_compiler

import tpbso_casadi as tp
from benchmarks.freeze.definitions import DEFINITIONS, INSTANCES
from benchmarks.suite import table_lines
from problems.evaluation import EvaluationOptions, NativeUnavailable
from tpbso_casadi.suite import InvalidSuite, Recording, SuiteProblem, frozen, kernels, problem, problem_named
from tpbso_casadi.suite.frozen import content_of
from tpbso_casadi.suite.motions import problem_of, problems_of

SUITE, SECOND = tp.suite(), tp.suite(version=2)
EVERY = [*SUITE, *(each for each in SECOND if each.suite == SECOND.name)]
PAGE = Path(__file__).parents[3] / "docs/reference/suite.md"
LIGHT = ("spline-2@1", "star-time@2", "constrained-3@1", "time-length-4@3")
FIRST = [each.name for each in EVERY if each.instance == 1]
ALL = [pytest.param(name, marks=pytest.mark.slow) for name in FIRST]
FRONTS = [each.name for each in EVERY if len(each.objectives) > 1]
KNOWN = [each.name for each in EVERY if each.best_known is not None]


def points_of(problem: SuiteProblem, rows: int = 200) -> np.ndarray:
    return np.random.default_rng(0).uniform(*problem.bounds, (rows, problem.dimension))


# What it holds


def test_all_functions_and_instances_in_order() -> None:
    assert len(SUITE) == len(DEFINITIONS) * INSTANCES
    assert [each.name for each in SUITE.functions] == [definition.name for definition in DEFINITIONS]
    assert SUITE[0].name == "arm-motions-1/paper-time-3@1" and SUITE[-1].instance == INSTANCES
    assert SUITE["spline-3@2"] is SUITE["arm-motions-1/spline-3@2"]
    assert [each.instance for each in SUITE[15:18]] == [1, 2, 3]
    assert {5, 6} <= {each.dimension for each in SUITE} and max(each.dimension for each in SUITE) == 56
    assert repr(SUITE[:30]) == "<suite arm-motions-1: 30 problems of 2 functions>"
    for definition, described in zip(DEFINITIONS, SUITE.functions, strict=True):
        for key in ("group", "form", "title", "fine"):
            assert getattr(described, key) == getattr(definition, key)
        assert len(described.objectives) == (2 if described.form == "two objectives" else 1)


def test_the_manual_lists_the_functions() -> None:
    assert "\n".join(table_lines()) in PAGE.read_text()


def test_some_of_it() -> None:
    some = tp.suite("arm-motions-1", functions=["narrow", "spline-2"], instances=[3, 1])
    assert [each.name.partition("/")[2] for each in some] == [
        *("spline-2@3", "spline-2@1", "narrow-3@3", "narrow-3@1", "narrow-5@3", "narrow-5@1")
    ]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: tp.suite("arm-motions-9"),
            "there is no suite 'arm-motions-9'; there are arm-motions-1 and arm-motions-2",
        ),
        (lambda: tp.suite(version=3), "there is no suite 'arm-motions-3'; there are arm-motions-1 and arm-motions-2"),
        (lambda: tp.suite("../suite"), "there is no suite '../suite'"),
        (lambda: SECOND["arm-motions-1/energy-3@1"], r"did you mean arm-motions-2/energy-3@1\?"),
        (lambda: tp.suite(functions=["nope"]), "no function or group 'nope'; the groups are paper, path, spline"),
        (lambda: tp.suite(functions=["splin-2"]), r"no function or group 'splin-2'; did you mean spline-2\?"),
        (lambda: tp.suite(instances=[1, 16]), "no instance 16; they are 1 to 15"),
        (lambda: tp.suite(threads=0), "threads: 0 is not within 1 and 256"),
        (lambda: tp.suite(threads=257), "threads: 257 is not within 1 and 256"),
        (lambda: SUITE["nope@1"], "there is no problem 'nope@1' in <suite arm-motions-1: "),
        (lambda: SUITE["splin-2@1"], r"did you mean arm-motions-1/spline-2@1\?"),
        (lambda: problem_named("spline-2@1"), "is no problem such as arm-motions-1/spline-3@1"),
    ],
)
def test_what_there_is_not(call: object, message: str) -> None:
    with pytest.raises(InvalidSuite, match=message) as caught:
        call()  # type: ignore[operator]
    assert "\n" not in str(caught.value)


def test_threads_are_a_whole_number() -> None:
    for wrong in ("2", 2.0, True):
        with pytest.raises(TypeError, match="threads: a whole number is needed"):
            tp.suite(threads=wrong)  # type: ignore[arg-type]
    assert tp.suite(threads=np.int64(2))[0].threads == 2  # type: ignore[arg-type]


# Values


@needs_compiler
@pytest.mark.parametrize("name", [*LIGHT, *ALL])
def test_the_bits_are_those_of_the_frozen_suite_and_of_the_models(name: str) -> None:
    """The kernels give what they gave, and what the scenario's problem gives today in CasADi's virtual machine."""
    each = SUITE[name] if "/" not in name else problem_named(name)
    assert each.is_intact()
    problem = problem_of(each.scenario, each.suite)
    candidates = points_of(each, 60)
    found = each.values(candidates)
    for number, part in enumerate(problems_of(problem, each.form)):
        merit = part.evaluator(EvaluationOptions("vm"))(candidates)
        assert np.array_equal(found.merit.reshape(60, -1)[:, number], merit)
    assert each.names == tuple(variable.name for variable in problem.variables)
    assert all(np.array_equal(*pair) for pair in zip(each.bounds, problem.bounds, strict=True))


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("function", [definition.name for definition in DEFINITIONS])
def test_every_instance_is_intact(function: str) -> None:
    assert all(each.is_intact() for each in EVERY if each.function.name == function)


@needs_compiler
@pytest.mark.parametrize("name", LIGHT)
def test_merit_is_feasibility_first(name: str) -> None:
    each = SUITE[name]
    candidates = points_of(each)
    merit, objectives, violations = each.values(candidates)
    assert merit.shape == ((200,) if len(each.objectives) == 1 else (200, 2))
    assert objectives.shape == (200, len(each.objectives)) and violations.shape == (200, len(each.constraint_names))
    assert np.isfinite(objectives).all() and (violations >= 0.0).all()
    merits = merit.reshape(200, -1)
    feasible = (violations == 0.0).all(axis=1)
    assert np.array_equal(feasible, merits[:, 0] <= each.feasible_merit)
    assert np.array_equal(merits[feasible], objectives[feasible])
    assert np.array_equal(each.constraints(candidates), violations)
    assert np.array_equal(each.merit(candidates), merit)


@needs_compiler
@pytest.mark.parametrize("name", ["spline-2@1", "time-length-4@3"])
def test_many_candidates_have_the_same_values_by_several_threads(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "CANDIDATES_PER_THREAD", 50)
    alone = SUITE[name]
    several = tp.suite(functions=[alone.function.name], instances=[alone.instance], threads=3)[0]
    assert several.threads == 3 and alone.threads == 1
    for count in (1, 99, 100, 211):
        candidates = points_of(alone, count)
        for one, other in zip(alone.values(candidates), several.values(candidates), strict=True):
            assert np.array_equal(one, other)


@needs_compiler
@pytest.mark.parametrize("name", ["spline-2@1", "star-time@6", "constrained-3@1", "time-length-4@3"])
def test_what_is_not_in_the_box_is_worth_nothing(name: str) -> None:
    each = SUITE[name]
    lower, upper = each.bounds
    inside = np.stack([lower, upper, (lower + upper) / 2.0])
    outside = np.repeat(inside[2:], 3, axis=0)
    outside[[0, 1, 2], [0, 1, -1]] = np.nan, np.nextafter(upper[1], np.inf), -np.inf
    assert each.contains(inside).all() and not each.contains(outside).any()
    found, alone = each.values(np.vstack([inside, outside])), each.values(inside)
    for values, expected in zip(found, alone, strict=True):
        assert np.array_equal(values[:3], expected) and np.isposinf(values[3:]).all()
    with pytest.raises(ValueError, match="x is not in the box"):
        each.decode(outside[0])


@needs_compiler
def test_forms() -> None:
    penalised, constrained, two = (SUITE[name] for name in ("spline-2@1", "constrained-3@1", "time-length-4@3"))
    for each, expected in ((penalised, "merit"), (constrained, "objectives"), (two, "objectives")):
        candidates = points_of(each, 20)
        wanted = getattr(each.values(candidates), expected)
        assert np.array_equal(each.evaluate(candidates), wanted if len(each.objectives) > 1 else wanted.reshape(20))
    assert two.evaluate(points_of(two, 4)).shape == (4, 2)
    for wrong in (np.zeros(16), np.zeros((3, 15))):
        with pytest.raises(ValueError, match=r"spline-2@1: candidates of shape .* where \(m, 16\) is needed"):
            penalised.evaluate(wrong)


@needs_compiler
def test_a_coarse_function_has_the_instances_of_its_fine_one() -> None:
    coarse, fine = SUITE["reduced-obstacle-4-coarse@4"], SUITE["reduced-obstacle-4@4"]
    assert coarse.function.fine == fine.function.name
    assert all(np.array_equal(*pair) for pair in zip(coarse.bounds, fine.bounds, strict=True))
    candidates = points_of(fine)
    near = (fine.constraints(candidates) == 0.0).all(axis=1) & (coarse.constraints(candidates) == 0.0).all(axis=1)
    assert near.any()
    assert 0.9 < np.median(coarse.merit(candidates)[near] / fine.merit(candidates)[near]) < 1.0  # chords are shorter
    assert not np.array_equal(coarse.merit(candidates), fine.merit(candidates))


@pytest.mark.process
@needs_compiler
def test_values_need_no_casadi_once_a_kernel_is_there() -> None:
    assert SUITE["spline-2@1"].is_intact()
    code = "import sys, tpbso_casadi as tp; p = tp.suite()['spline-2@1']; assert p.is_intact(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"casadi", "problems", "scipy", "matplotlib"} & {*done.stdout.split()}


def test_without_a_compiler_the_models_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> None:
        raise NativeUnavailable("no C++ compiler")

    each = SUITE["star-time@2"]
    monkeypatch.setattr(kernels, "_known", lambda key: None)
    monkeypatch.setattr("problems.evaluation.usable_compiler", refuse)
    fresh = SuiteProblem(each.suite, each.function, 3)
    content_of.cache_clear()  # and with it what has been loaded
    assert fresh.is_intact()
    broken = SuiteProblem(each.suite, replace(each.function, checks=("0" * 64,) * INSTANCES), 3)
    with pytest.raises(InvalidSuite, match="without a C\\+\\+ compiler this version does not give the suite's values"):
        broken.merit(points_of(broken, 1))
    content_of.cache_clear()


def test_a_library_that_others_could_write_is_not_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernels.CACHE, str(tmp_path))
    tmp_path.chmod(0o700)
    (tmp_path / "key.so").write_bytes(b"")
    (tmp_path / "key.so").chmod(0o600)
    assert kernels._known("key") == tmp_path / "key.so"
    (tmp_path / "key.so").chmod(0o666)
    assert kernels._known("key") is None
    (tmp_path / "link.so").symlink_to(tmp_path / "key.so")
    assert kernels._known("link") is None and kernels._known("other") is None


def test_what_is_no_library_is_reported(tmp_path: Path) -> None:
    (tmp_path / "key.so").write_bytes(b"no library")
    with pytest.raises(kernels.NoCompiler, match="what was compiled cannot be loaded"):
        kernels._loaded(tmp_path / "key.so")


# Files


def test_other_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frozen, "folder_of", lambda suite: tmp_path)
    monkeypatch.setattr(problem, "folder_of", lambda suite: tmp_path)
    with pytest.raises(InvalidSuite, match=r"f\.npz\.xz: No such file"):
        content_of("s", "f", "0")
    (tmp_path / "f.npz.xz").write_bytes(b"other")
    with pytest.raises(InvalidSuite, match=r"f\.npz\.xz: is not the file that belongs to this suite"):
        content_of("s", "f", "0")
    with pytest.raises(InvalidSuite, match=r"best_known\.json: is not the file"):
        problem._known("s")


# What is known


def test_of_two_objectives_a_front_is_known() -> None:
    assert KNOWN
    for each in EVERY:
        front = each.best_front
        assert (front is None) == (len(each.objectives) == 1)
        assert front is None or (each.best_known is None and each.best_merit == 0.0)


@needs_compiler
@pytest.mark.parametrize("name", FRONTS)
def test_candidates_of_a_front_have_their_values_and_all_but_a_little_of_its_volume(name: str) -> None:
    each = problem_named(name)
    front = each.best_front
    assert front is not None
    assert np.array_equal(each.merit(front.x), front.values)
    assert (front.values <= front.nadir).all() and (front.values >= front.ideal).all()
    run = Recording(each, "known")
    run(front.x)
    assert 0.0 <= run.merits[-1] < 0.1 and run.feasible_from == 1
    assert all(0.0 <= share <= 1.0 for share in front.ways.values())


def test_known_values_keep_what_is_said_of_them() -> None:
    for each in map(problem_named, KNOWN):
        known = each.best_known
        assert known is not None
        assert known.value <= each.feasible_merit and known.x.shape == (each.dimension,)
        lower, upper = each.bounds
        assert (known.x >= lower).all() and (known.x <= upper).all()
        assert any(hits for hits, _ in known.ways.values()) and all(hits <= runs for hits, runs in known.ways.values())
        if each.lower_bound is not None and known.certified:
            assert known.motion_value >= each.lower_bound * (1.0 - 1e-9)
            assert known.descended_value is None or known.descended_value >= each.lower_bound * (1.0 - 1e-9)


@needs_compiler
@pytest.mark.parametrize("name", [name for name in KNOWN if name.endswith(("/spline-2@1", "/star-time@1"))])
def test_known_candidates_have_their_values_and_motions(name: str) -> None:
    _check_known(problem_named(name))


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("name", KNOWN)
def test_every_known_candidate_has_its_value_and_motion(name: str) -> None:
    _check_known(problem_named(name))


def _check_known(each: SuiteProblem) -> None:
    known = each.best_known
    assert known is not None
    assert each.merit(known.x[None])[0] == known.value
    motion = each.decode(known.x)
    assert motion.certified == each.certify(known.x) == known.certified
    assert motion.objective == pytest.approx(known.motion_value, rel=1e-9)


def test_a_motion_can_be_seen() -> None:
    each = SUITE["spline-2@1"]
    motion = each.decode(np.mean(each.bounds, axis=0))
    assert not motion.certified and "violated" in repr(motion) and "spline-2@1" in repr(motion)
    assert {verdict.name for verdict in motion.verdicts} >= {"speed", "acceleration", "clearance"}
    assert motion.trajectory.duration == pytest.approx(motion.objective)
    assert motion.plot().axes
    with pytest.raises(ValueError, match="there is no figure 'nope'"):
        motion.plot("nope")
    with pytest.raises(ValueError, match=r"x of shape \(3,\) where \(16,\) is needed"):
        each.decode(np.zeros(3))
