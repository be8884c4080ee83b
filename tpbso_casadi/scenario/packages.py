"""Packages of ROS by their names, and the files that a URDF names: beside it, or in packages."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from problems import InvalidProblem
from problems.robots import MeshShape, ReadFile
from tpbso_casadi.scenario.input_files import LARGEST_MESH, InputFolder, is_file, is_folder, read_bytes
from tpbso_casadi.scenario.validation import ScenarioError

SCHEMES = ("package://", "model://")
PACKAGE_PATHS = {"ROS_PACKAGE_PATH": "", "AMENT_PREFIX_PATH": "share"}  # folders of packages, and where in them
DEEPEST = 3  # folders between one of a variable and a package in it
NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
MANIFEST = "package.xml"
LARGEST_MANIFEST = 100_000  # bytes


@dataclass(frozen=True)
class RobotFiles:
    """The files of a robot in the folder of a scenario and in packages of ROS, and those that its URDF names.

    Attributes:
        folder: of the scenario, which says what may be read.
        packages: folders of packages, by their names.
        near: a folder in that one, in and above which packages are looked for too.
    """

    folder: InputFolder
    packages: Mapping[str, str] = field(default_factory=dict)
    near: str = ""

    def path(self, name: str) -> Path:
        """The path of a file that the scenario names, which may be read.

        Args:
            name: a path from the folder of the scenario, or a URL.

        Raises:
            ScenarioError: its package is nowhere, or it may not be read.
        """
        if name.startswith(SCHEMES):
            return self._find(name, self.folder.path)
        return self.folder.checked(self.folder.path / name)

    def meshes(self, urdf: str) -> ReadFile:
        """The reader of the meshes that a URDF names; an error is that of ``mesh``.

        Args:
            urdf: name of its file.

        Raises:
            ScenarioError: as :meth:`path`.
        """
        beside = self.path(urdf).absolute().parent

        def read(shape: MeshShape) -> bytes:
            try:
                return read_bytes(self._find(shape.file, beside), LARGEST_MESH)
            except ScenarioError as error:
                raise InvalidProblem("mesh", str(error)) from error

        return read

    def _find(self, name: str, beside: Path) -> Path:
        """The path of a file that may be read.

        Args:
            name: a path from a folder, or a URL.
            beside: that folder, in and above which packages are looked for too.

        Raises:
            ScenarioError: there is none, or it may not be read.
        """
        scheme = next((scheme for scheme in SCHEMES if name.startswith(scheme)), None)
        if scheme is None:
            path = beside / name.removeprefix("file://")
            if not is_file(path):
                raise ScenarioError("there is no such file")
            return self.checked(path)
        package, _, rest = name.removeprefix(scheme).partition("/")
        places = list(self._places(package, beside))
        for place in places:
            if is_file(place / rest):
                return self.checked(place / rest)
        if not places:
            raise self._not_found(package, beside)
        cure = f"; {_cure(package)}" if package and package not in self.packages else ""
        raise ScenarioError(f"there is no such file in {places[0]}{cure}")

    def package(self, name: str, beside: Path) -> Path:
        """The folder of a package.

        Args:
            name: of the package.
            beside: a folder, in and above which it is looked for too.

        Raises:
            ScenarioError: it is nowhere, with the places that were searched, or may not be read.
        """
        for place in self._places(name, beside):
            if is_folder(place):
                return self.checked(place)
        raise self._not_found(name, beside)

    def checked(self, path: Path) -> Path:
        """A path that may be read: in the folder of the scenario, or where the user's environment keeps packages.

        Raises:
            ScenarioError: it lies elsewhere.
        """
        place = Path(os.path.normpath(path.absolute()))
        trusted = any(place.is_relative_to(root.absolute()) for root, _ in _roots())
        return path if trusted else self.folder.checked(path)

    def _places(self, package: str, beside: Path) -> Iterator[Path]:
        """Folders that are a package, the likeliest first; for no name all in which the rest of a URL is looked for."""
        if package in self.packages:
            yield self.folder.path / self.packages[package]
            return
        if not package:
            yield from self._above(beside)
            return
        for root, inner in _roots():
            yield from _places_in(root / inner, package, DEEPEST)
            if inner and _is_package(root, package):
                yield root
        for above in self._above(beside):
            yield from _places_in(above, package, 1)

    def _above(self, beside: Path) -> list[Path]:
        """The folders in which packages are looked for, from two on upwards, each once."""
        starts = [beside.absolute(), (self.folder.path / self.near).absolute()]
        return list(dict.fromkeys(above for start in starts for above in (start, *start.parents)))

    def _not_found(self, package: str, beside: Path) -> ScenarioError:
        """The error of a package that is nowhere."""
        if package in self.packages:
            return ScenarioError(f"package {package!r}: there is no folder {self.packages[package]}")
        variables = [f"{variable} ({os.environ.get(variable) or 'not set'})" for variable in PACKAGE_PATHS]
        starts = " or ".join(dict.fromkeys(str(start.absolute()) for start in (beside, self.folder.path / self.near)))
        where = f"neither in {', '.join(variables)}, nor in or above {starts}"
        return ScenarioError(f"package {package!r} is {where}; {_cure(package)}")


def _cure(package: str) -> str:
    return f'packages = {{ {package} = "FOLDER" }} says where'


def _roots() -> list[tuple[Path, str]]:
    """The folders in which the user's environment keeps packages, and where in them."""
    names = ((os.environ.get(variable, ""), inner) for variable, inner in PACKAGE_PATHS.items())
    return [(Path(name), inner) for listed, inner in names for name in listed.split(os.pathsep) if name]


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
