"""Files of a user: regular ones of a sensible size, as text or TOML, and where a scenario may look for them."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from problems.base.toml import toml_tables
from tpbso_casadi.scenario.section import ScenarioError

LARGEST_FILE = 10_000_000  # bytes
LARGEST_TOML = 1_000_000  # bytes, which take a second to parse


@dataclass(frozen=True)
class InputFolder:
    """The folder of a scenario file, which holds the files that the scenario names.

    Attributes:
        path: of the folder.
        outside_allowed: whether a scenario may also name files that lie elsewhere.
    """

    path: Path
    outside_allowed: bool = False

    def read_text(self, name: str) -> str:
        """The text of a file that a scenario names.

        Raises:
            ScenarioError: it lies outside the folder, links followed, or cannot be read; never with its content.
        """
        path = self.path / name
        if not self.outside_allowed:
            try:
                inside = path.resolve().is_relative_to(self.path.resolve())
            except (OSError, RuntimeError, ValueError) as error:
                raise ScenarioError(f"{path}: cannot be read: {reason_of(error)}") from error
            if not inside:
                raise ScenarioError(f"{path}: lies outside the scenario's folder; --allow-outside-files allows that")
        return read_text(path)


def read_text(path: Path, largest: int = LARGEST_FILE) -> str:
    """The text of a regular file in UTF-8.

    Args:
        path: of the file; pipes, devices and folders are refused before they are opened.
        largest: size that is read, bytes.

    Raises:
        ScenarioError: it cannot be read, is larger, or is not text.
    """
    try:
        return _content(path, largest).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not a text file: {error.reason} at byte {error.start}") from error
    except (OSError, ValueError) as error:
        raise ScenarioError(f"{path}: cannot be read: {reason_of(error)}") from error


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        ScenarioError: it cannot be read, or is not TOML.
    """
    text = read_text(path, LARGEST_TOML)
    try:
        return toml_tables(text)
    except ValueError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _content(path: Path, largest: int) -> bytes:
    _check_regular(path.stat())
    without_waiting = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)  # should it have become a pipe since
    with os.fdopen(os.open(path, without_waiting), "rb") as file:
        _check_regular(os.fstat(file.fileno()))
        content = file.read(largest + 1)
    if len(content) > largest:
        raise ValueError(f"it is larger than {largest / 1e6:g} MB")
    return content


def _check_regular(status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise ValueError("it is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("it is a pipe, a device or a socket, not a file")


def is_folder(name: str) -> bool:
    """Whether there is a folder of that name; False for what cannot be a name."""
    try:
        return Path(name).is_dir()
    except OSError:
        return False


def reason_of(error: Exception) -> str:
    """Why the operating system refuses a path, or why it is not a path at all."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
