"""Configuration folders of MoveIt, as its Setup Assistant writes them: which files state the robot."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Annotated, Any, Self

from problems.base import Count, InvalidTable
from tpbso_casadi.scenario.input_files import InputFolder, is_file, is_folder, read_text
from tpbso_casadi.scenario.validation import ScenarioError, Section, as_scenario_errors, named

ASSISTANT = ".setup_assistant"
ROOT = "moveit_setup_assistant_config"
LIMITS = "config/joint_limits.yaml"
LARGEST_ASSISTANT = 1_000_000  # bytes, and characters of a text in it
Text = Annotated[str, Count(0, 1000)]


class _StatedFile(Section):
    """A file that the Setup Assistant names."""

    package: Text = ""
    relative_path: Text = ""
    xacro_args: Text = ""

    @classmethod
    def read(cls, document: Any, kind: str) -> Self:
        """Read the entry of a kind of file, ``URDF`` or ``SRDF``, which may be missing."""
        root = document.get(ROOT, {}) if isinstance(document, dict) else {}
        table = (root.get(kind) or root.get(kind.lower())) if isinstance(root, dict) else None
        known = {key: value for key, value in table.items() if key in cls.schema()} if isinstance(table, dict) else {}
        with as_scenario_errors(kind):
            return cls.from_table({key: value for key, value in known.items() if value is not None})

    def check(self) -> None:
        if any(":=" not in word for word in self._words):
            raise InvalidTable(f"NAME:=VALUE is needed, not {self.xacro_args!r}", "xacro_args")

    @property
    def _words(self) -> list[str]:
        return shlex.split(self.xacro_args)

    @property
    def arguments(self) -> dict[str, str]:
        """The arguments of its xacro, by their names."""
        return {name: value for name, _, value in (word.partition(":=") for word in self._words)}

    def name(self, folder: str) -> str:
        """The name of the file, of a package or in the folder of the configuration; empty where none is stated."""
        where = f"package://{self.package}" if self.package else folder
        return f"{where}/{self.relative_path}" if self.relative_path else ""


def moveit_keys(folder: InputFolder, name: str, stated: Collection[str]) -> dict[str, Any]:
    """The keys of a robot's table that a configuration states: ``urdf``, ``srdf``, ``limits``, ``xacro_arguments``.

    The URDF is the one that ``.setup_assistant`` names, or else the only one in ``config``. The SRDF is the only one in
    ``config``, or else the one that is named.

    Args:
        folder: of the scenario.
        name: of the folder of the configuration, in that folder.
        stated: keys that are not looked for.

    Raises:
        ScenarioError: it is no such folder, lies outside the scenario's folder, or has several files of a kind.
    """
    path = folder.checked(folder.path / name)
    if not is_folder(path / "config"):
        raise ScenarioError(f"{path}: no configuration of MoveIt: it has no folder config")
    with named(path):
        document = _assistant(path / ASSISTANT)
        urdf, srdf = _StatedFile.read(document, "URDF"), _StatedFile.read(document, "SRDF")
        finders: dict[str, Callable[[], Any]] = {
            "urdf": lambda: urdf.name(name) or _only(path, name, "urdf"),
            "srdf": lambda: _only(path, name, "srdf", xacro=False) or srdf.name(name) or _only(path, name, "srdf"),
            "limits": lambda: f"{name}/{LIMITS}" if is_file(path / LIMITS) else "",
            "xacro_arguments": lambda: urdf.arguments,
        }
        found = {key: find() for key, find in finders.items() if key not in stated}
    return {key: value for key, value in found.items() if value}


def _assistant(path: Path) -> Any:
    """The content of the file of the Setup Assistant; nothing where there is none."""
    if not is_file(path):
        return {}
    from tpbso_casadi.scenario.yaml_text import yaml_document  # noqa: PLC0415 (loads a library for these files alone)

    try:
        return yaml_document(read_text(path, LARGEST_ASSISTANT))
    except ScenarioError:
        raise
    except ValueError as error:
        raise ScenarioError(f"{ASSISTANT}: {error}") from error


def _only(path: Path, name: str, kind: str, xacro: bool = True) -> str:
    """The name of the only file of a kind in ``config``, else of the only one in xacro; empty where there is none.

    Raises:
        ScenarioError: there are several.
    """
    for ending in (kind, f"{kind}.xacro")[: 1 + xacro]:
        files = sorted(path.glob(f"config/*.{ending}"))
        if len(files) > 1:
            several = ", ".join(file.name for file in files)
            raise ScenarioError(f'{kind}: there are {several}; {kind} = "FILE" says which')
        if files:
            return f"{name}/config/{files[0].name}"
    return ""
