"""A program for one maker's controller: its text, and what is proven of the motion that the controller makes of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from problems import CertificateStatus, Robot
from problems.base import Checked, FloatArray, InvalidTable, Table
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.storage import OutputError, write_with, writing


class Proof(NamedTuple):
    """A statement on the motion that a controller makes of a program, and whether it is proven.

    Attributes:
        statement: what would hold.
        status: of the proof.
    """

    statement: str
    status: CertificateStatus


@dataclass(frozen=True, kw_only=True)
class Program:
    """The files of a program, and what is known of the motion that they make.

    Attributes:
        content: what is in them, in words.
        proofs: on the motion.
        assumptions: what the maker does not document, or what has to be so; a line each.
        unstated: what the plan has and the format cannot say; a line each.
        planned: the status of the plan itself.
        files: texts, or bytes, by the names of their files.
    """

    content: str
    proofs: tuple[Proof, ...]
    assumptions: tuple[str, ...]
    unstated: tuple[str, ...]
    planned: CertificateStatus
    files: Mapping[str, str | bytes] = field(default_factory=dict)

    @property
    def proven(self) -> bool:
        """Whether the plan is certified and every statement on the program is."""
        return {self.planned, *(proof.status for proof in self.proofs)} == {CertificateStatus.CERTIFIED}

    @property
    def lines(self) -> list[str]:
        """The content, the plan, the proofs, the assumptions and what is not said, a line each."""
        return [
            self.content,
            f"{self.planned}: {ITSELF}",
            *(f"{proof.status}: {proof.statement}" for proof in self.proofs),
            *(f"assumed: {line}" for line in self.assumptions),
            *(f"not in the program: {line}" for line in self.unstated),
        ]

    @property
    def remarks(self) -> list[str]:
        """The content and the proofs beside the plan that is known; none where nothing is to be proven."""
        return [line for line in self.lines if not line.endswith(ITSELF)] if self.proofs else []

    @property
    def notes(self) -> list[str]:
        """The content, the proofs and all else in short lines, as comments."""
        return [part for line in self.lines for part in wrap(line, LONGEST_NOTE, subsequent_indent="  ")]

    def with_files(self, files: Mapping[str, str | bytes]) -> Program:
        """The program with its files, of which the comments say what is known."""
        return replace(self, files=files)

    def write(self, folder: str | Path) -> list[Path]:
        """Write the files into a folder.

        Raises:
            OutputError: one cannot be written.
        """
        place = Path(folder)
        with writing(place):
            return [write_with(place / name, partial(_write, content=content)) for name, content in self.files.items()]


def _write(path: Path, content: str | bytes) -> None:
    path.write_bytes(content.encode() if isinstance(content, str) else content)


ITSELF = "the plan itself"
LONGEST_NAME, LONGEST_REMARK, LONGEST_NOTE = 24, 28, 76  # characters


def is_identifier(name: str) -> bool:
    """Whether a name is one in the languages of all controllers."""
    return name.isascii() and name.isidentifier() and len(name) <= LONGEST_NAME


def identifier(name: str) -> str:
    """A name that is one in the languages of all controllers.

    Raises:
        InvalidTable: it is none.
    """
    if not is_identifier(name):
        raise InvalidTable(f"at most {LONGEST_NAME} letters, digits and underscores are needed, a letter first")
    return name


@dataclass(frozen=True, eq=False)
class Coding:
    """The numbers of a controller's axes, made of joint values and read back.

    Attributes:
        matrix: from joint values in rad or m to the numbers, (dof, dof).
        digits: of the numbers behind the point.
    """

    matrix: FloatArray
    digits: int

    def encoded(self, rows: FloatArray) -> FloatArray:
        """Rows of joint values (n, dof) as a program states them."""
        return np.round(rows @ self.matrix.T, self.digits) + 0.0  # without -0

    def decoded(self, values: FloatArray) -> FloatArray:
        """Rows of a program (n, dof) as joint values, rad or m."""
        return np.asarray(np.linalg.solve(self.matrix, values.T).T)

    @property
    def rounding(self) -> FloatArray:
        """How far a joint value read back may be from what was meant, (dof,), rad or m."""
        return np.asarray(np.abs(np.linalg.inv(self.matrix)).sum(axis=1) * 0.5 * 10.0**-self.digits)

    def text(self, values: FloatArray) -> list[str]:
        """Numbers of a row as a program states them."""
        return [f"{value:.{self.digits}f}" for value in values.tolist()]


class Signal(NamedTuple):
    """A signal within a program: its name and value, and the digital output that has it.

    Attributes:
        name: of the signal.
        value: that is told.
        output: number of the output that is switched; None where none is stated.
        on: whether it is switched on.
    """

    name: str
    value: bool | float | str
    output: int | None
    on: bool

    @property
    def said(self) -> str:
        """Name and value, short and of printable ASCII: they must not end a comment."""
        text = f"{self.name}={self.value}"[:LONGEST_REMARK]
        return "".join(sign if sign.isascii() and sign.isprintable() else "?" for sign in text)


IN_RADIANS, IN_DEGREES = (1.0, 1.0), (180.0 / np.pi, 1000.0)


class Exporter(Table, ABC):
    """A writer of plans for other programs; its keys are the settings.

    Attributes:
        title: of the format.
    """

    title: ClassVar[str]

    @abstractmethod
    def program(self, plan: PlannedMotion) -> Program:
        """The files of a plan, with what is known of the motion that is made of them.

        Raises:
            OutputError: the format cannot state it, or a setting is missing.
        """


class ControllerExporter(Exporter):
    """A writer of programs for the controllers of one maker.

    Attributes:
        axes: that it has at most.
        per_unit: numbers in a rad of a joint that turns, and in a m of one that slides.
        digits: of the numbers behind the point.
        name: of the program.
        outputs: numbers of digital outputs by signals: of one that is true or false its name, of one with words
            ``name=word``, and then a negative number switches off.
    """

    axes: ClassVar[int]
    per_unit: ClassVar[tuple[float, float]] = IN_DEGREES
    digits: ClassVar[int] = 6

    name: Annotated[str, Checked(identifier)] = "tpbso"
    outputs: dict[str, int] = field(default_factory=dict)

    def signal(self, name: str, value: bool | float | str) -> Signal:
        """A signal of a plan as this program tells it."""
        if isinstance(value, str):
            number = self.outputs.get(f"{name}={value}")
            return Signal(name, value, None if number is None else abs(number), (number or 0) > 0)
        return Signal(name, value, self.outputs.get(name) if value in (0, 1) else None, bool(value))

    def silent(self, signals: Iterable[Signal]) -> list[str]:
        """Lines on signals for which no output is stated."""
        return [f"signal {each.said}: outputs names no output for it" for each in signals if each.output is None]

    def coding(self, robot: Robot) -> Coding:
        """The numbers of the controller's axes.

        Raises:
            OutputError: the controller has fewer axes, or a setting is missing.
        """
        if robot.dof > self.axes:
            raise OutputError(f"{self.title}: {self.axes} axes at most, not {robot.dof}")
        if robot.dim != 3:
            raise OutputError(f"{self.title}: a robot in space is needed, as of a URDF; this one is planar")
        turning, sliding = self.per_unit
        return Coding(np.diag([turning if unit == "rad" else sliding for unit in robot.joints.units]), self.digits)
