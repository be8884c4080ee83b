"""The house: which package may import which, what stays unloaded, what the README promises."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FORBIDDEN = {"solvers": {"problems", "tpbso_casadi"}, "problems": {"solvers", "tpbso_casadi"}, "tpbso_casadi": set()}
MODULES = [path for package in FORBIDDEN for path in sorted((ROOT / package).glob("**/*.py"))]


def imported(path: Path, everywhere: bool = True) -> set[str]:
    """Top-level names of the packages that a module imports, inside functions too or not."""
    tree = ast.parse(path.read_text())
    nodes = ast.walk(tree) if everywhere else iter(tree.body)
    names = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
    return {name.split(".")[0] for name in names}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_follow_the_arrows(path: Path) -> None:
    assert not imported(path) & FORBIDDEN[path.relative_to(ROOT).parts[0]]
    if "figures" not in str(path.relative_to(ROOT)):
        assert "matplotlib" not in imported(path, everywhere=True)
    assert ast.get_docstring(ast.parse(path.read_text()))


def test_planning_without_figures_does_not_load_matplotlib() -> None:
    code = "import sys, tpbso_casadi.solve; print('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_continuous_integration_runs_the_readme_command() -> None:
    [command] = [line for line in (ROOT / ".ci/run").read_text().splitlines() if line.startswith("python3 -m venv")]
    assert f"    {command}\n" in (ROOT / "README.md").read_text()
