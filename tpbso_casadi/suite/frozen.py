"""What is stored of a suite: descriptions of its functions, and kernels and numbers of their instances.

``suite.json`` says what there is, ``FUNCTION.npz.xz`` has the rest: the C++ of each kernel, the numbers of each
instance, boxes, and the scenarios that they come from. A suite that extends another one has files of those functions
alone that differ.
"""

from __future__ import annotations

import io
import json
import lzma
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from hashlib import sha256
from math import modf, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from tpbso_casadi.suite.kernels import FloatArray, SuiteKernel

SUITES = ("arm-motions-1", "arm-motions-2")
SUITE = SUITES[0]  # the default: results of it are published
INTEGRALS_AT_SAMPLES = (SUITE,)  # suites that count one side alone of every jump of an acceleration
DESCRIPTIONS = "suite.json"
CHECK_POINTS = 64  # of an instance
INVALID_FILE = "is not the file that belongs to this suite; install the package anew"


class InvalidSuite(ValueError):
    """No such suite, function or instance, or a file of one that is not what it should be; the message is one line."""


@dataclass(frozen=True, kw_only=True)
class Description:
    """A function, as far as it is told without its file.

    Attributes:
        name: of it.
        group: of functions that are judged together.
        title: what it is.
        form: how constraints and objectives are seen by a solver.
        fine: of a coarse function the one whose instances it has.
        dimension: of the search box.
        variables: their names.
        objectives: names and units.
        constraints: names of the violations.
        instances: how many.
        digest: of the function's file.
        checks: digests of the values at the check points, one for each instance.
    """

    name: str
    group: str
    title: str
    form: str
    fine: str
    dimension: int
    variables: tuple[str, ...]
    objectives: tuple[tuple[str, str], ...]
    constraints: tuple[str, ...]
    instances: int
    digest: str
    checks: tuple[str, ...]

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> Description:
        """The description that :meth:`plain` gave."""
        lists = {key: tuple(value) for key, value in content.items() if isinstance(value, list)}
        lists["objectives"] = tuple((name, unit) for name, unit in content["objectives"])
        return cls(**{**content, **lists})

    @property
    def plain(self) -> dict[str, Any]:
        """The description as JSON holds it."""
        return asdict(self)


@dataclass(frozen=True, eq=False, kw_only=True)
class FunctionContent:
    """The file of a function with n instances.

    Attributes:
        kernels: one for each objective.
        numbers: of each kernel, (n, p).
        indices: likewise, (n, q).
        lower: corners of the search boxes, (n, d).
        upper: likewise.
        bounds: the merit up to which a candidate is feasible, by kernel and instance, (kernels, n).
        scenarios: tables of the scenario files.
    """

    kernels: tuple[SuiteKernel, ...]
    numbers: tuple[FloatArray, ...]
    indices: tuple[Any, ...]
    lower: FloatArray
    upper: FloatArray
    bounds: FloatArray
    scenarios: tuple[dict[str, Any], ...]

    def values(self, kernel: int, instance: int, points: FloatArray, threads: int = 1) -> FloatArray:
        """Merit, objective and violations (m, k) of points (m, d) of an instance, counted from 0."""
        row = self.numbers[kernel][instance], self.indices[kernel][instance]
        return self.kernels[kernel](points, *row, threads)

    def written(self) -> bytes:
        """The bytes of the file."""
        arrays: dict[str, Any] = {"lower": self.lower, "upper": self.upper, "bounds": self.bounds}
        texts = [kernel.source for kernel in self.kernels]
        header = {"values": [kernel.values for kernel in self.kernels], "scenarios": self.scenarios}
        for number, (source, numbers, indices) in enumerate(zip(texts, self.numbers, self.indices, strict=True)):
            arrays |= {f"source_{number}": _bytes(source), f"numbers_{number}": numbers, f"indices_{number}": indices}
        file = io.BytesIO()
        np.savez(file, header=_bytes(json.dumps(header)), **arrays)
        return lzma.compress(file.getvalue(), preset=6)

    @classmethod
    def read(cls, content: bytes) -> FunctionContent:
        """The content that :meth:`written` gave."""
        with np.load(io.BytesIO(lzma.decompress(content)), allow_pickle=False) as file:
            header = json.loads(file["header"].tobytes())
            each = [(number, values) for number, values in enumerate(header["values"])]
            return cls(
                kernels=tuple(SuiteKernel(file[f"source_{k}"].tobytes().decode(), values) for k, values in each),
                numbers=tuple(file[f"numbers_{k}"] for k, _ in each),
                indices=tuple(file[f"indices_{k}"] for k, _ in each),
                lower=file["lower"],
                upper=file["upper"],
                bounds=file["bounds"],
                scenarios=tuple(header["scenarios"]),
            )


def _bytes(text: str) -> Any:
    return np.frombuffer(text.encode(), dtype=np.uint8)


def check_points(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Points (64, d) of a box, the same bits everywhere: multiples of square roots of primes, without whole parts."""
    roots = [sqrt(prime) for prime in _primes(lower.size)]
    shares = np.array([[modf(k * root)[0] for root in roots] for k in range(1, CHECK_POINTS + 1)])
    return np.ascontiguousarray(lower + shares * (upper - lower))


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


def digest_of(values: FloatArray) -> str:
    """The digest of the bits of values."""
    return sha256(np.ascontiguousarray(values, dtype="<f8").tobytes()).hexdigest()


def folder_of(suite: str) -> Path:
    """The folder in which the files of a suite lie."""
    return Path(__file__).with_name(suite.replace("-", "_"))


NEAR = {  # links too near each other for the frozen spheres to tell whether they touch
    "panda": [["panda_link5", "panda_link7"], ["panda_link5", "panda_hand"], ["panda_link6", "panda_hand"]],
    "ur5e": [["base_link", "upper_arm_link"]],
}


def with_frozen_spheres(suite: str, tables: dict[str, Any]) -> dict[str, Any]:
    """Tables of a scenario whose built-in robot has the spheres that it had when the suite was frozen.

    Args:
        suite: its name.
        tables: of a scenario file.
    """
    robot = tables.get("robot", {})
    path = folder_of(suite) / f"{robot.get('model')}-spheres.toml"
    if not path.is_file():
        return tables
    stated = {"spheres_text": path.read_text(encoding="utf-8"), "disabled_pairs": NEAR[robot["model"]]}
    return {**tables, "robot": {**robot, **stated}}


@cache
def descriptions(suite: str) -> tuple[tuple[str, Description], ...]:
    """The functions of a suite, in order, each with the suite that it comes from: this one, or one that this extends.

    Raises:
        InvalidSuite: there is no such suite.
    """
    if suite not in SUITES:
        raise InvalidSuite(f"there is no suite {suite!r:.60}; there are {' and '.join(SUITES)}")
    content = json.loads((folder_of(suite) / DESCRIPTIONS).read_text(encoding="utf-8"))
    own = [(suite, Description.of(each)) for each in content["functions"]]
    if "extends" not in content:
        return tuple(own)
    others = {each.name: (owner, each) for owner, each in own}
    return tuple(others.get(each.name, (owner, each)) for owner, each in descriptions(content["extends"]))


@cache
def content_of(suite: str, function: str, digest: str) -> FunctionContent:
    """The file of a function.

    Raises:
        InvalidSuite: it is missing, or another one.
    """
    path = folder_of(suite) / f"{function}.npz.xz"
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InvalidSuite(f"{path}: {error.strerror}") from error
    if sha256(content).hexdigest() != digest:
        raise InvalidSuite(f"{path}: {INVALID_FILE}")
    return FunctionContent.read(content)
