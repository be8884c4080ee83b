"""The house: who may import whom, what stays unloaded, what no code asks; and what the README promises."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FORBIDDEN = {"solvers": {"problems", "tpbso_casadi"}, "problems": {"solvers", "tpbso_casadi"}, "tpbso_casadi": set()}
FLOORS = {
    "base": 1,
    "evaluation": 2,
    "robots": 2,
    "scene": 2,
    "motions": 3,
    "limits": 4,
    "objectives": 4,
    "timing": 4,
    "tasks": 5,
    "certify": 5,
    "encodings": 6,
    "nlp": 7,
    "sequential": 7,
    "assembly": 8,
}
MOST_MODULES = 13  # of its own in one folder
KIND_NAMES = {"paper", "reduced", "time", "rotation", "length", "point-to-point", "path"}
KIND_CLASSES = {
    *("Problem", "PointToPointProblem", "PathFollowingProblem", "MoveProblem"),
    *("Task", "PointToPoint", "PathFollowing", "Move"),
}
DRAWING = ("figures", "moving_figures")  # folders and modules that may load matplotlib
LOADED_FOR_TYPES = "TYPE_CHECKING"


@dataclass(frozen=True)
class Module:
    """A source file of one of the packages."""

    path: Path

    def __str__(self) -> str:
        return str(self.path.relative_to(ROOT))

    @cached_property
    def name(self) -> str:
        parts = self.path.relative_to(ROOT).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    @property
    def package(self) -> str:
        return self.name.split(".")[0]

    @property
    def folder(self) -> str:
        """The floor of a module of ``problems``; empty for the package itself."""
        parts = self.path.relative_to(ROOT).parts
        return parts[1] if len(parts) > 2 else ""

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.path.read_text())

    def imports(self, everywhere: bool = True) -> set[str]:
        """Dotted names of what is imported: everywhere, or only when the module is loaded."""
        nodes = ast.walk(self.tree) if everywhere else loaded(self.tree.body)
        return {name for node in nodes for name in self._names(node)}

    def imports_that_run(self) -> set[str]:
        """The same without those for type checkers alone."""
        for_types = [node for node in ast.walk(self.tree) if isinstance(node, ast.If) and is_for_types(node)]
        skipped = {inner for node in for_types for part in node.body for inner in ast.walk(part)}
        return {name for node in ast.walk(self.tree) if node not in skipped for name in self._names(node)}

    def _names(self, node: ast.AST) -> Iterator[str]:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                own = self.name.split(".") if self.path.stem == "__init__" else self.name.split(".")[:-1]
                base = ".".join([*own[: len(own) + 1 - node.level], *([base] if base else [])])
            yield from (f"{base}.{alias.name}" if f"{base}.{alias.name}" in NAMES else base for alias in node.names)


def is_for_types(node: ast.If) -> bool:
    return LOADED_FOR_TYPES in ast.unparse(node.test)


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
NAMES = {module.name for module in MODULES}
each_module = pytest.mark.parametrize("module", MODULES, ids=str)


@each_module
def test_packages_import_along_the_arrows(module: Module) -> None:
    assert not {name.split(".")[0] for name in module.imports()} & FORBIDDEN[module.package]


@each_module
def test_every_module_says_what_it_is(module: Module) -> None:
    assert ast.get_docstring(module.tree)


@each_module
def test_matplotlib_is_loaded_by_figures_alone(module: Module) -> None:
    if not any(word in part for part in (*module.name.split("."),) for word in DRAWING):
        assert "matplotlib" not in {name.split(".")[0] for name in module.imports_that_run()}


# Floors


def test_every_folder_of_problems_has_a_floor() -> None:
    assert {module.folder for module in MODULES if module.package == "problems"} == {"", *FLOORS}


@pytest.mark.parametrize("module", [m for m in MODULES if m.package == "problems" and m.folder], ids=str)
def test_imports_run_downwards_only(module: Module) -> None:
    for name in module.imports():
        package, *parts = name.split(".")
        if package != "problems":
            continue
        assert parts, f"{module} imports the whole package"
        assert parts[0] == module.folder or FLOORS[parts[0]] < FLOORS[module.folder], name
        if module.folder == "evaluation":
            assert parts[0] in {"evaluation", "base"}, name


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
    graph = {module.name: module.imports(everywhere=False) & NAMES for module in MODULES}
    assert circles(graph) == []


def test_no_folder_is_crowded() -> None:
    folders = {module.path.parent for module in MODULES}
    sizes = {str(folder.relative_to(ROOT)): len(list(folder.glob("[!_]*.py"))) for folder in folders}
    assert {folder: size for folder, size in sizes.items() if size > MOST_MODULES} == {}


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
        if hasattr(part, "ctx") and isinstance(part, ast.Name | ast.Attribute)
    }


def questions(tree: ast.Module) -> Iterator[ast.Call]:
    """Calls of isinstance and issubclass."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {"isinstance", "issubclass"}:
            yield node


def compared(tree: ast.Module) -> Iterator[tuple[int, set[str]]]:
    """Lines that compare with, or match, the name of a kind."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            names = set().union(*(strings(operand) for operand in (node.left, *node.comparators)))
        elif isinstance(node, ast.MatchValue):
            names = strings(node.value)
        else:
            continue
        if names & KIND_NAMES:
            yield node.lineno, names & KIND_NAMES


def own_names(tree: ast.Module) -> set[str]:
    """Names that classes of a module call themselves: ``name: ClassVar[str] = ...``."""
    return {
        statement.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        for statement in node.body
        if isinstance(statement, ast.AnnAssign)
        and isinstance(statement.target, ast.Name)
        and statement.target.id == "name"
        and isinstance(statement.value, ast.Constant)
    }


@each_module
def test_nothing_compares_with_the_name_of_a_kind(module: Module) -> None:
    own = own_names(module.tree)
    assert [(line, names - own) for line, names in compared(module.tree) if names - own] == []


@each_module
def test_nothing_asks_which_problem_it_has(module: Module) -> None:
    assert [call.lineno for call in questions(module.tree) if named_in(call.args[1]) & KIND_CLASSES] == []


def test_comparisons_and_questions_are_found() -> None:
    lines = [
        'if kind == "paper" or x in ("time", 1): ...',
        "match y:",
        '    case "path": ...',
        "isinstance(p, (A, b.Task))",
    ]
    tree = ast.parse("\n".join(lines))
    assert [names for _, names in compared(tree)] == [{"paper"}, {"time"}, {"path"}]
    [call] = questions(tree)
    assert named_in(call.args[1]) & KIND_CLASSES == {"Task"}


# What is promised


def test_planning_without_figures_does_not_load_matplotlib() -> None:
    code = "import sys, tpbso_casadi.cli.commands.solve; print('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_continuous_integration_runs_the_readme_command() -> None:
    [command] = [line for line in (ROOT / ".ci/run").read_text().splitlines() if line.startswith("python3 -m venv")]
    assert f"    {command}\n" in (ROOT / "README.md").read_text()
