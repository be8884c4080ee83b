"""The house: who may import whom, what stays unloaded, what no code asks; and what continuous integration runs.

Each rule is one test over all modules; what it says names every module that breaks it.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FORBIDDEN = {"solvers": {"problems", "tpbso_casadi"}, "problems": {"solvers", "tpbso_casadi"}, "tpbso_casadi": set()}
FLOORS = {  # of the folders of a package; a package that is not here has none
    "problems": {
        **{"base": 1, "evaluation": 2, "library": 3, "geometry": 4, "robots": 5, "scene": 5, "motions": 6},
        **{"core": 7, "limits": 8, "objectives": 8, "timing": 8, "tasks": 9, "certify": 9},
        **{"programs": 10, "worlds": 10, "polish": 11, "assembly": 11, "families": 12},
    },
    "tpbso_casadi": {
        **{"plain": 1, "html": 1, "scenario": 2, "planning": 3, "replanning": 4, "storage": 4},
        **{"audit_report": 5, "display": 5, "programs": 5, "simulation": 5, "figures": 6},
        **{"animation": 7, "reaching": 7, "suite": 7, "trade_off": 7, "judging": 8, "layouts": 9, "reproduction": 9},
        **{"facade": 10, "api": 11, "cli": 12},
    },
}
KNOWS_ONLY = {("problems", "evaluation"): {"base"}}  # folders that may know less than their floor lets them
KIND_NAMES = {"paper", "reduced", "time", "rotation", "length", "point-to-point", "path"}
KIND_CLASSES = {
    *("Problem", "PointToPointProblem", "PathFollowingProblem", "MoveProblem"),
    *("Task", "PointToPoint", "PathFollowing", "Move"),
}
DRAWING = ("figures", "moving_figures")  # folders and modules that may load matplotlib


@dataclass(frozen=True)
class Module:
    """A source file of one of the packages, parsed once."""

    path: Path

    def __str__(self) -> str:
        return str(self.path.relative_to(ROOT))

    @cached_property
    def parts(self) -> tuple[str, ...]:
        parts = self.path.relative_to(ROOT).with_suffix("").parts
        return parts[:-1] if parts[-1] == "__init__" else parts

    @cached_property
    def name(self) -> str:
        return ".".join(self.parts)

    @property
    def package(self) -> str:
        return self.parts[0]

    @property
    def folder(self) -> str:
        """Of its package; of a module directly in it its name where that has a floor, else nothing."""
        if (folder := self.path.relative_to(ROOT).parts[1]) != self.path.name:
            return folder
        return self.path.stem if self.path.stem in FLOORS.get(self.package, {}) else ""

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.path.read_text())

    @cached_property
    def nodes(self) -> list[ast.AST]:
        return list(ast.walk(self.tree))

    @cached_property
    def imports(self) -> set[str]:
        """Dotted names of all that is imported anywhere."""
        return self.named_by(self.nodes)

    @cached_property
    def imports_that_run(self) -> set[str]:
        """The same without those for type checkers alone."""
        for_types = [node for node in self.nodes if isinstance(node, ast.If) and is_for_types(node)]
        skipped = {inner for node in for_types for part in node.body for inner in ast.walk(part)}
        return self.named_by(node for node in self.nodes if node not in skipped)

    @cached_property
    def imports_when_loaded(self) -> set[str]:
        return self.named_by(loaded(self.tree.body))

    def named_by(self, nodes: Iterable[ast.AST]) -> set[str]:
        """Names that import statements name: modules of ours in full, of others what stands after ``from``."""
        names: set[str] = set()
        for node in nodes:
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                own = self.parts if self.path.stem == "__init__" else self.parts[:-1]
                above = own[: len(own) + 1 - node.level] if node.level else ()
                base = ".".join([*above, *([node.module] if node.module else [])])
                names |= {full if (full := f"{base}.{alias.name}") in BY_NAME else base for alias in node.names}
        return names


def is_for_types(node: ast.If) -> bool:
    return "TYPE_CHECKING" in ast.unparse(node.test)


def loaded(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Statements that run when a module is imported, without those for type checkers alone."""
    for statement in body:
        yield statement
        if isinstance(statement, ast.If) and is_for_types(statement):
            yield from loaded(statement.orelse)
        elif not isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
            for part in ("body", "orelse", "finalbody"):
                yield from loaded(getattr(statement, part, []))
            for handler in getattr(statement, "handlers", []):
                yield from loaded(handler.body)


MODULES = [Module(path) for package in FORBIDDEN for path in sorted((ROOT / package).glob("**/*.py"))]
BY_NAME = {module.name: module for module in MODULES}


def nobody(breaks: Callable[[Module], object]) -> None:
    """No module breaks a rule; the message has what each one that does has done."""
    found = {str(module): done for module in MODULES if (done := breaks(module))}
    assert not found, "\n".join(f"{module}: {done}" for module, done in found.items())


def packages_in(names: Iterable[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


def test_there_are_modules_in_every_package() -> None:
    assert {module.package for module in MODULES} == set(FORBIDDEN)
    assert len(MODULES) > 100


def test_packages_import_along_the_arrows() -> None:
    nobody(lambda module: packages_in(module.imports) & FORBIDDEN[module.package])


def test_every_module_says_what_it_is() -> None:
    nobody(lambda module: not ast.get_docstring(module.tree))


def test_matplotlib_is_loaded_by_figures_alone() -> None:
    def loads(module: Module) -> bool:
        draws = any(word in part for part in module.parts for word in DRAWING)
        return not draws and "matplotlib" in packages_in(module.imports_that_run)

    nobody(loads)


# Floors


def above(module: Module, floors: dict[str, int]) -> set[str]:
    """What a module in a folder imports of its package though it may not."""
    known = KNOWS_ONLY.get((module.package, module.folder))
    allowed = {folder for folder, floor in floors.items() if floor < floors[module.folder]} if known is None else known
    imports = module.imports_that_run if module.package == "tpbso_casadi" else module.imports
    inner = {name: name.split(".")[1:] for name in imports if name.split(".")[0] == module.package}
    whole = {module.package} if module.package == "problems" else set()  # of the application it is the version alone
    return {name for name, parts in inner.items() if (parts[0] not in {*allowed, module.folder} if parts else whole)}


@pytest.mark.parametrize("package", FLOORS)
def test_every_folder_has_a_floor(package: str) -> None:
    assert {module.folder for module in MODULES if module.package == package} == {"", *FLOORS[package]}


def test_imports_run_downwards_only() -> None:
    nobody(lambda module: module.package in FLOORS and module.folder and above(module, FLOORS[module.package]))


def test_imports_upwards_are_found() -> None:
    module = next(module for module in MODULES if module.folder == "limits")
    floors = FLOORS["problems"]
    assert not above(module, floors)
    assert above(module, floors | {"limits": 1})


def test_what_has_no_floor_starts_a_command() -> None:
    def others(module: Module) -> set[str]:
        own = {name for name in module.imports if packages_in([name]) == {"tpbso_casadi"}}
        return {name for name in own if not name.startswith("tpbso_casadi.cli")}

    starts = ("tpbso_casadi", "tpbso_casadi.__init__")
    nobody(lambda m: m.package == "tpbso_casadi" and not m.folder and m.name not in starts and others(m))


# Faces


LOADED_LATER = ("figures", "animation", "page", "export", "logs")  # draw, write pages or load other libraries


def faces() -> dict[str, set[str]]:
    """Folders whose ``__init__`` says what others may use of them, and what that is."""
    named: dict[str, set[str]] = {}
    for module in MODULES:
        for node in module.tree.body if module.path.stem == "__init__" and module.name != "problems" else ():
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                named[module.name] = strings(node.value)
    return named


def test_a_folder_is_used_by_what_its_face_names() -> None:
    known = faces()

    def is_behind(name: str, user: Module) -> bool:
        over = [face for face in known if name.startswith(f"{face}.") and not f"{user.name}.".startswith(f"{face}.")]
        is_named = any(name.removeprefix(f"{face}.") in known[face] for face in over)  # a function of a module's name
        return bool(over) and not is_named and not any(word in name for word in LOADED_LATER)

    assert known
    nobody(
        lambda user: {
            each for each in user.imports_when_loaded & BY_NAME.keys() - known.keys() if is_behind(each, user)
        }
    )


# Circles


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Strongly connected components of more than one module (Tarjan)."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []

    def visit(name: str) -> None:
        index[name] = lowest[name] = len(index)
        stack.append(name)
        for other in sorted(graph[name]):
            if other not in index:
                visit(other)
                lowest[name] = min(lowest[name], lowest[other])
            elif other in stack:
                lowest[name] = min(lowest[name], index[other])
        if lowest[name] == index[name]:
            component = set(stack[stack.index(name) :])
            del stack[stack.index(name) :]
            if len(component) > 1 or name in graph[name]:
                found.append(component)

    for name in sorted(graph):
        if name not in index:
            visit(name)
    return found


def test_circles_are_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"d"}, "e": {"a", "d"}}
    assert sorted(sorted(circle) for circle in circles(graph)) == [["b", "c"], ["d"]]


def test_nothing_imports_in_circles() -> None:
    """Types and imports within functions included."""
    assert circles({module.name: module.imports & BY_NAME.keys() for module in MODULES}) == []


# What no code asks: which kind of problem it has


def strings(node: ast.expr) -> set[str]:
    """String constants that an operand of a comparison is, or holds."""
    held = node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else [node]
    return {part.value for part in held if isinstance(part, ast.Constant) and isinstance(part.value, str)}


def named_in(node: ast.expr) -> set[str]:
    """Names of the classes that a second argument of isinstance has."""
    return {
        part.id if isinstance(part, ast.Name) else part.attr
        for part in ast.walk(node)
        if isinstance(part, ast.Name | ast.Attribute)
    }


def questions(nodes: Iterable[ast.AST]) -> Iterator[ast.Call]:
    """Calls of isinstance and issubclass."""
    for node in nodes:
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {"isinstance", "issubclass"}:
            yield node


def compared(nodes: Iterable[ast.AST]) -> Iterator[tuple[int, set[str]]]:
    """Lines that compare with, or match, the name of a kind."""
    for node in nodes:
        if isinstance(node, ast.Compare):
            names = set().union(*(strings(operand) for operand in (node.left, *node.comparators)))
        elif isinstance(node, ast.MatchValue):
            names = strings(node.value)
        else:
            continue
        if names & KIND_NAMES:
            yield node.lineno, names & KIND_NAMES


def own_names(nodes: Iterable[ast.AST]) -> set[str]:
    """Names that classes of a module call themselves: ``name: ClassVar[str] = ...``."""
    return {
        statement.value.value
        for node in nodes
        if isinstance(node, ast.ClassDef)
        for statement in node.body
        if isinstance(statement, ast.AnnAssign)
        and isinstance(statement.target, ast.Name)
        and statement.target.id == "name"
        and isinstance(statement.value, ast.Constant)
    }


def test_nothing_compares_with_the_name_of_a_kind() -> None:
    def lines(module: Module) -> list[int]:
        own = own_names(module.nodes)
        return [line for line, names in compared(module.nodes) if names - own]

    nobody(lines)


def test_nothing_asks_which_problem_it_has() -> None:
    nobody(lambda module: [call.lineno for call in questions(module.nodes) if named_in(call.args[1]) & KIND_CLASSES])


def test_comparisons_and_questions_are_found() -> None:
    lines = [
        'if kind == "paper" or x in ("time", 1): ...',
        "match y:",
        '    case "path": ...',
        "isinstance(p, (A, b.Task))",
    ]
    nodes = list(ast.walk(ast.parse("\n".join(lines))))
    assert [names for _, names in compared(nodes)] == [{"paper"}, {"time"}, {"path"}]
    [call] = questions(nodes)
    assert named_in(call.args[1]) & KIND_CLASSES == {"Task"}


# What is promised


LOADED_WHEN_USED = (
    "matplotlib",
    "trimesh",
    "jinja2",
    "yaml",
    "asyncio",
    "tpbso_casadi.judging",
    "tpbso_casadi.suite",
    "scipy.interpolate",
    "scipy.optimize",
    "scipy.stats",
    "scipy.linalg",
)


def loaded_by(code: str) -> set[str]:
    """Which of those a process has loaded that has run some code."""
    program = f"import sys; {code}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    return {*run.stdout.split()} & {*LOADED_WHEN_USED}


@pytest.mark.process
@pytest.mark.parametrize("scenario", ["time-3", "examples/panda-cage.toml"])
def test_a_plan_without_figures_loads_little(scenario: str, tmp_path: Path) -> None:
    arguments = [scenario, "--no-plots", "--quiet", "--out", str(tmp_path / "run")]
    assert loaded_by(f"from tpbso_casadi.cli.commands import solve; solve.main({arguments!r})") == set()


@pytest.mark.process
def test_the_overview_loads_the_standard_library_alone() -> None:
    run = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "tpbso_casadi", "--help"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    loaded = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in run.stderr.splitlines()}
    assert not loaded & {"numpy", "casadi", "scipy", "rich", "problems", "solvers"}


def test_continuous_integration_runs_the_commands_of_the_readme() -> None:
    shown = (ROOT / "README.md").read_text()
    commands = [line for line in (ROOT / ".ci/run").read_text().splitlines() if "pytest" in line]
    assert [command.split()[0] for command in commands] == ["python3", ".venv/bin/pytest"]
    assert all(f"    {command}\n" in shown for command in commands)
