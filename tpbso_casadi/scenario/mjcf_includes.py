"""Files that an MJCF file includes, put in its place."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from problems import InvalidProblem
from problems.robots import document
from tpbso_casadi.scenario.input_files import read_text
from tpbso_casadi.scenario.packages import RobotFiles
from tpbso_casadi.scenario.validation import ScenarioError

INCLUDE = "include"


def with_includes(path: Path, text: str, files: RobotFiles) -> str:
    """The text of a file, with the content of those that it includes where it is an MJCF that does.

    Args:
        path: of the file, beside which the others lie.
        text: of it.
        files: what knows which may be read.

    Raises:
        ScenarioError: one is included twice, may not be read, or is no XML.
    """
    if f"<{INCLUDE}" not in text or "<mujoco" not in text:
        return text
    root = _root(path, text)
    _replace(root, path.parent, files, {path.name})
    return ET.tostring(root, encoding="unicode")


def _replace(element: ET.Element, folder: Path, files: RobotFiles, known: set[str]) -> None:
    """Put the children of included files in the place of each ``include`` in an element."""
    children = list(element)
    for child in children:
        if child.tag != INCLUDE:
            _replace(child, folder, files, known)
            continue
        name = child.get("file", "")
        if name in known:
            raise ScenarioError(f"{folder / name}: it is included twice")
        known.add(name)
        path = files.checked(folder / name)
        included = _root(path, read_text(path))
        _replace(included, folder, files, known)
        place = list(element).index(child)
        element[place : place + 1] = list(included)


def _root(path: Path, text: str) -> ET.Element:
    try:
        return document(text)
    except InvalidProblem as error:
        raise ScenarioError(f"{path}: {error.reason}") from error
