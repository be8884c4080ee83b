"""Files of xacro, the macro language of ROS, expanded by the package ``xacro`` where it is installed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from types import ModuleType

from tpbso_casadi.plain import one_line
from tpbso_casadi.scenario.packages import RobotFiles
from tpbso_casadi.scenario.validation import ScenarioError

ENDING = ".xacro"
MISSING = (
    "a file of xacro needs the package xacro: pip install 'tpbso-casadi[ros]', or expand it: xacro FILE > robot.urdf"
)
ONE_AT_A_TIME = Lock()  # the package keeps what it reads in its module


class _Arguments(dict[str, str]):
    """Arguments by their names, which remember whether the file has them."""

    def __init__(self, stated: Mapping[str, str]) -> None:
        super().__init__(stated)
        self.unused = set(stated)

    def __contains__(self, name: object) -> bool:
        self.unused.discard(str(name))
        return super().__contains__(name)


def expanded(path: Path, arguments: Mapping[str, str | float | bool], files: RobotFiles, all_known: bool = True) -> str:
    """The text of a file with its macros, arguments and includes put in.

    Packages, ``$(find NAME)``, are found as those of meshes, whether or not ROS is installed.

    Args:
        path: of the file, which may be read.
        arguments: ``$(arg NAME)``, by their names.
        files: what finds packages, and knows what may be read.
        all_known: whether the file has to have all of the arguments.

    Raises:
        ScenarioError: the package ``xacro`` is missing, the file cannot be expanded, has no argument of a name, or
            includes one that may not be read; in one line.
    """
    try:
        import xacro  # noqa: PLC0415 (is optional)
    except ImportError as error:
        raise ScenarioError(f"{path}: {MISSING}") from error
    given = _Arguments({name: _word(value) for name, value in arguments.items()})

    def find(name: str) -> str:
        return str(files.package(name, path.parent).absolute())

    with ONE_AT_A_TIME, _index(find):
        xacro.all_includes.clear()
        try:
            text = str(xacro.process_file(str(path.absolute()), mappings=given, verbosity=0).toxml())
        except Exception as error:
            raise ScenarioError(
                f"{path}: cannot be expanded: {one_line(str(error)) or type(error).__name__}"
            ) from error
        included = [Path(name) for name in xacro.all_includes]
    for file in included:
        files.checked(file)
    if given.unused and all_known:
        known = ", ".join(name for name in given if name not in given.unused) or "none"
        raise ScenarioError(f"{path}: has no argument {min(given.unused)!r}; there are {known}")
    return text


def _word(value: str | float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


@contextmanager
def _index(find: Callable[[str], str]) -> Iterator[None]:
    """Let the modules of ROS in which xacro looks for packages find them in our way.

    What is imported meanwhile stays: a second copy of a module has other classes.
    """
    index, packages = ModuleType("ament_index_python"), ModuleType("ament_index_python.packages")
    packages.get_package_share_directory = find  # type: ignore[attr-defined]
    ours = {module.__name__: module for module in (index, packages)}
    theirs = {name: sys.modules[name] for name in ours if name in sys.modules}
    sys.modules.update(ours)
    try:
        yield
    finally:
        for name in ours:
            del sys.modules[name]
        sys.modules.update(theirs)
