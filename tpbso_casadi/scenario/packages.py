"""Packages of ROS by their names, and the files that a URDF names: beside it, or in packages."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from problems import InvalidProblem
from problems.robots import MeshShape
from tpbso_casadi.scenario.input_files import LARGEST_MESH, InputFolder, is_file, is_folder, read_bytes
from tpbso_casadi.scenario.validation import ScenarioError

SCHEMES = ("package://", "model://")
PACKAGE_PATHS = {"ROS_PACKAGE_PATH": "", "AMENT_PREFIX_PATH": "share"}  # folders of packages, and where in them
DEEPEST = 3  # folders between one of a variable and a package in it
NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
MANIFEST = "package.xml"
LARGEST_MANIFEST = 100_000  # bytes


@dataclass(frozen=True)
class UrdfFiles:
    """The files that a URDF names.

    Attributes:
        folder: of the scenario, which says what may be read.
        urdf: name of the URDF's file, in that folder.
        packages: folders of packages, by their names.
    """

    folder: InputFolder
    urdf: str
    packages: Mapping[str, str] = field(default_factory=dict)

    @property
    def beside(self) -> Path:
        """The folder of the URDF."""
        return (self.folder.path / self.urdf).absolute().parent

    def mesh(self, shape: MeshShape) -> bytes:
        """The content of the file of a mesh.

        Raises:
            InvalidProblem: ``mesh`` is not there, lies outside the folder and in no package that the environment names,
                or cannot be read.
        """
        try:
            return read_bytes(self.find(shape.file), LARGEST_MESH)
        except ScenarioError as error:
            raise InvalidProblem("mesh", str(error)) from error

    def find(self, name: str) -> Path:
        """The path of a file.

        Args:
            name: as the URDF has it: a path from there, or a URL.

        Raises:
            ScenarioError: there is none, or it may not be read.
        """
        scheme = next((scheme for scheme in SCHEMES if name.startswith(scheme)), None)
        if scheme is None:
            path = self.beside / name.removeprefix("file://")
            if not is_file(path):
                raise ScenarioError("there is no such file")
            return self.folder.checked(path)
        package, _, rest = name.removeprefix(scheme).partition("/")
        places = list(self._places(package))
        for place, trusted in places:
            if is_file(place / rest):
                return place / rest if trusted else self.folder.checked(place / rest)
        if not places:
            raise self._not_found(package)
        cure = f"; {_cure(package)}" if package and package not in self.packages else ""
        raise ScenarioError(f"there is no such file in {places[0][0]}{cure}")

    def package(self, name: str) -> Path:
        """The folder of a package.

        Raises:
            ScenarioError: it is nowhere, with the places that were searched, or may not be read.
        """
        for place, trusted in self._places(name):
            if is_folder(place):
                return place if trusted else self.folder.checked(place)
        raise self._not_found(name)

    def _places(self, package: str) -> Iterator[tuple[Path, bool]]:
        """Folders that are a package, the likeliest first, and whether the user's environment vouches for them."""
        if package in self.packages:
            yield self.folder.path / self.packages[package], False
            return
        roots = [(Path(root), inner) for variable, inner in PACKAGE_PATHS.items() for root in _folders_in(variable)]
        for root, inner in roots if package else ():
            yield from ((place, True) for place in _places_in(root / inner, package, DEEPEST))
            if inner and _is_package(root, package):
                yield root, True
        for above in (self.beside, *self.beside.parents):
            yield from ((place, False) for place in (_places_in(above, package, 1) if package else (above,)))

    def _not_found(self, package: str) -> ScenarioError:
        """The error of a package that is nowhere."""
        if package in self.packages:
            return ScenarioError(f"package {package!r}: there is no folder {self.packages[package]}")
        variables = [f"{variable} ({os.environ.get(variable) or 'not set'})" for variable in PACKAGE_PATHS]
        where = f"neither in {', '.join(variables)}, nor in or above {self.beside}"
        return ScenarioError(f"package {package!r} is {where}; {_cure(package)}")


def _cure(package: str) -> str:
    return f'packages = {{ {package} = "FOLDER" }} says where'


def _folders_in(variable: str) -> list[str]:
    return list(filter(None, os.environ.get(variable, "").split(os.pathsep)))


def _places_in(root: Path, package: str, deepest: int) -> Iterator[Path]:
    """Folders that are a package: that of its name, the root itself, or others by their manifests."""
    yield from (place for place in (root / package, root) if is_folder(place) and _is_package(place, package))
    yield from (place for place in _packages_below(root, deepest) if _is_package(place, package))


def _packages_below(root: Path, deepest: int) -> Iterator[Path]:
    """Folders with a manifest within another one, down to a depth; none is searched within a package."""
    try:
        inner = sorted(entry.path for entry in os.scandir(root) if entry.is_dir() and not entry.name.startswith("."))
    except OSError:
        return
    for name in inner:
        if is_file(Path(name) / MANIFEST):
            yield Path(name)
        elif deepest > 1:
            yield from _packages_below(Path(name), deepest - 1)


def _is_package(folder: Path, name: str) -> bool:
    """Whether a folder is a package of a name, by its manifest, or where it has none by its own name."""
    manifest = folder / MANIFEST
    if not is_file(manifest):
        return folder.name == name
    try:
        found = NAME.search(read_bytes(manifest, LARGEST_MANIFEST))
    except ScenarioError:
        return False
    return found is not None and found[1].decode("utf-8", "replace") == name
