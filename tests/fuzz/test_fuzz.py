"""Whatever a file holds or a user types: one line and a fitting exit status, in time."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from fuzz.hostile import FILES, PLUGINS
from fuzz.outcome import Tally, run, run_process
from fuzz.values import NUMBERS, WORDS, edited, extremes, places, scenarios
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.plain import SEAL
from tpbso_casadi.storage import sealed

QUICK = ["--evaluations", "40", "--no-plots", "--quiet"]
STATED = os.environ.get("TPBSO_FUZZ_EXAMPLES")  # how many, which is the seed too, of a night of fuzzing
EXAMPLES = [int(STATED)] if STATED else [4, pytest.param(1500, marks=pytest.mark.slow)]
POLISHED = 7  # of the numbers 0 to 9; neither end, which Hypothesis prefers: it takes seconds
Trial = Callable[..., None]


def fuzzed(examples: int, **strategies: st.SearchStrategy[Any]) -> Callable[[Trial], Trial]:
    """Run a trial with so many examples, the same every time; the first that fails is reported as it is."""
    options = settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=[Phase.explicit, Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    return lambda trial: seed(examples)(options(given(**strategies)(trial)))


def optional(strategy: st.SearchStrategy[str]) -> st.SearchStrategy[list[str]]:
    return st.lists(strategy, max_size=1)


def mangled(text: st.SearchStrategy[str]) -> st.SearchStrategy[bytes]:
    """Text of which a part has been replaced by bytes."""

    def cut(content: str, start: float, length: int, filling: bytes) -> bytes:
        data = content.encode("utf-8", "surrogatepass")
        at = int(start * len(data))
        return data[:at] + filling + data[at + length :]

    return st.builds(cut, text, st.floats(0.0, 1.0), st.integers(0, 50), st.binary(max_size=20))


@pytest.mark.parametrize("examples", EXAMPLES)
def test_scenarios(workplace: Path, tally: Tally, examples: int) -> None:
    @fuzzed(examples, text=scenarios() | extremes(), polish=st.integers(0, 9))
    def trial(text: str, polish: int) -> None:
        Path("mine.toml").write_text(text, encoding="utf-8")
        arguments = ["mine.toml", *QUICK, "--iterations", "5", "--time-limit", "5", "--out", "out"]
        tally.check(text, run(solve.main, [*arguments, *["--polish"] * (polish == POLISHED)]))

    trial()


@pytest.mark.parametrize("examples", EXAMPLES)
def test_files_that_are_no_scenarios(workplace: Path, tally: Tally, examples: int) -> None:
    commands = st.sampled_from([solve.main, audit.main])

    @fuzzed(examples, data=mangled(scenarios()) | st.binary(max_size=100), command=commands)
    def trial(data: bytes, command: Callable[[Sequence[str]], int]) -> None:
        Path("mine.toml").write_bytes(data)
        further = [*QUICK, "--iterations", "5", "--time-limit", "5", "--out", "out"] if command is solve.main else []
        tally.check(data, run(command, ["mine.toml", *further]))

    trial()


CELLS = st.sampled_from([*NUMBERS, *WORDS, "1,0", "1;0", "\0", "1_0", "٣"]) | st.floats().map(str) | st.text(max_size=5)
LINES = st.lists(st.lists(CELLS, max_size=3).map(",".join), max_size=6).map("\n".join)
ROWS = st.lists(st.lists(CELLS, min_size=2, max_size=4).map(",".join), max_size=5).map("\n".join)
HEADERS = st.sampled_from(["t,x,y\n", "t,x,y,angle\n", "t,x,y\n0,3,3\n"])
PLANAR = "[arm]\nlink_lengths = [1.0, 1.0]\nmax_speed = 4.0\nmax_acceleration = 20.0\n[task]\n"
TABLES = {  # what a scenario says of a file, and what the file holds
    "points": ('kind = "path"\naccuracy = 0.05\npoints = "table.csv"\n', LINES | st.just("x,y\n1,0\n1.5,0.5\n1,1\n")),
    "motion": (
        'kind = "point-to-point"\nstart = [1.5, 0.0]\ngoal = [1.0, 1.0]\n'
        '[[obstacles]]\ncenter = [0.0, 0.0]\nsemi_axes = [0.1, 0.1]\nmotion = "table.csv"\n',
        st.tuples(HEADERS, ROWS).map("".join) | st.just("t,x,y,angle\n0,3,3,0\n1,3,2,1\n"),
    ),
}


@pytest.mark.parametrize("examples", EXAMPLES)
@pytest.mark.parametrize("kind", TABLES)
def test_files_that_scenarios_name(workplace: Path, tally: Tally, kind: str, examples: int) -> None:
    task, tables = TABLES[kind]

    @fuzzed(examples, data=mangled(tables))
    def trial(data: bytes) -> None:
        Path("table.csv").write_bytes(data)
        Path("mine.toml").write_text(PLANAR + task)
        tally.check(data, run(solve.main, ["mine.toml", *QUICK, "--iterations", "5", "--out", "out"]))

    trial()


COUNTED = ["--links", "--population", "--iterations", "--evaluations", "--polish-starts", "--threads", "--seed"]
OTHER_FOLDERS = [word for word in WORDS if word not in ("/", "..", ".")]
TYPED = {
    **dict.fromkeys([*COUNTED, "--rate", "--time-limit"], NUMBERS + WORDS),
    "--within": ["0.05", "1e-12", "0", "nan", "inf", "1e308", "5e-324", "a" * 5000, "-1"],
    **{key: [*WORDS, *PLUGINS, "rotation", "pso", "ipopt", "ga"] for key in ("--objective", "--solver")},
    **dict.fromkeys(("--elbow", "--formulation", "--knot-redundancy"), WORDS),
    "--backend": ["vm", *WORDS],
    "--out": ["out", "good.toml", "\udcfe", "new/[red]/x", "a\nb", *FILES, *OTHER_FOLDERS],
    "--animate": [*FILES, "film.html", "no/film.html", "\udcff.html", "a.gif", ".html", "/dev/null", "/dev/full.html"],
    "--export": ["csv", "npz", "ros-json", "ros-yaml", *WORDS],
}
FLAGS = ["--polish", "--json", "--no-plots", "--certify", "--allow-outside-files", "--list", "--help", "--", "-x"]
BUDGET = ["--time-limit", "5", "--evaluations", "40", "--iterations", "5"]


@st.composite
def command_lines(draw: st.DrawFn) -> list[str]:
    """Arguments of ``solve``, most of them wrong."""
    arguments = draw(optional(st.sampled_from(["time-2", "good.toml", *FILES, *WORDS]) | st.text(max_size=20)))
    arguments += ["--no-plots", "--quiet", *BUDGET, "--out", "out"]
    for _ in range(draw(st.integers(0, 3))):
        option = draw(st.sampled_from([*TYPED, *FLAGS]))
        arguments.append(option)
        if option in TYPED:
            arguments.append(draw(st.sampled_from(TYPED[option])))
    return arguments


@pytest.mark.parametrize("examples", EXAMPLES)
def test_command_lines(workplace: Path, tally: Tally, examples: int) -> None:
    @fuzzed(examples, arguments=command_lines())
    def trial(arguments: list[str]) -> None:
        tally.check(arguments, run(solve.main, arguments))

    trial()


@pytest.fixture(scope="module")
def good_run(workplace: Path) -> Path:
    """A run folder that is what it should be."""
    Path("sound").mkdir()
    command = ["time-2", "--evaluations", "600", "--no-plots", "--quiet", "--polish", "--out", "sound/run"]
    assert solve.main(command) == 0
    return workplace / "sound/run"


ODD = [None, True, 0, -1, 10**400, 2**63, 1e308, 5e-324, "", "[red]", "a" * 5000, "\0", [], {}, [[]], {"a": []}]
JSON = st.sampled_from(ODD) | st.floats() | st.text(max_size=5) | st.lists(st.floats(), max_size=4)


@st.composite
def edits(draw: st.DrawFn, text: str) -> bytes:
    """The bytes of a file with one to three values replaced or removed, or with some bytes replaced."""
    if draw(st.booleans()):
        return draw(mangled(st.just(text)))
    content = json.loads(text)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(places(content)))
        content = edited(content, path, draw(JSON), draw(st.booleans()))
        if not isinstance(content, dict | list) or not content:
            break
    if isinstance(content, dict) and draw(st.booleans()):  # as a forger would
        content = sealed({key: value for key, value in content.items() if key != SEAL})
    return json.dumps(content).encode()


@pytest.mark.parametrize("examples", EXAMPLES)
def test_run_folders(good_run: Path, tally: Tally, examples: int) -> None:
    result, table = (good_run / "result.json").read_text(), (good_run / "trajectory.csv").read_text()

    results = edits(result) | st.just(result.encode())

    @fuzzed(examples, result=results, table=mangled(st.just(table)) | st.just(table.encode()))
    def trial(result: bytes, table: bytes) -> None:
        folder = Path("edited")
        folder.mkdir(exist_ok=True)
        (folder / "result.json").write_bytes(result)
        (folder / "trajectory.csv").write_bytes(table)
        tally.check((result, table[:200]), run(audit.main, ["edited"]))

    trial()


@pytest.mark.parametrize("name", ["result.json", "trajectory.csv"])
def test_run_folders_of_odd_files(good_run: Path, tally: Tally, name: str) -> None:
    folder = Path("odd")
    for odd in ("pipe.csv", "folder.csv", "circle.csv", "gone.csv", "/dev/zero", "socket.toml"):
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(good_run, folder)
        (folder / name).unlink()
        (folder / name).symlink_to(Path(odd).absolute())
        outcome = run(audit.main, ["odd"])
        tally.check((name, odd), outcome)
        assert outcome.status == 2, odd


@pytest.mark.process
@pytest.mark.slow
def test_real_processes(good_run: Path, tally: Tally) -> None:
    commands = ["tpbso_casadi.solve"], ["tpbso_casadi", "audit"], ["tpbso_casadi", "compare"]

    @fuzzed(100, command=st.sampled_from(commands), arguments=command_lines())
    def trial(command: list[str], arguments: list[str]) -> None:
        usable = [argument for argument in arguments if "\0" not in argument]
        tally.check((command, usable), run_process([*command, *usable]))

    trial()
