"""Files that are not what they should be: plug-ins that raise, exit or recurse; pipes, folders, links in circles."""

from __future__ import annotations

import os
import socket
from pathlib import Path

MODULES = {
    "hostile_raises": "raise RuntimeError('two\\nlines [red]')\n",
    "hostile_exits": "raise SystemExit(0)\n",
    "hostile_base": "class Own(BaseException): ...\nraise Own('x' * 10_000)\n",
    "hostile_interrupts": "raise KeyboardInterrupt\n",
    "hostile_prints": "print('noise')\n",
    "hostile_recurses": "def f(): f()\nf()\n",
    "hostile_garbled": "class (:\n\0",
    "hostile_unsayable": "class Mute(Exception):\n    def __str__(self): raise ValueError\nraise Mute\n",
    "hostile_attributes": "def __getattr__(name): raise ZeroDivisionError(name)\n",
    "hostile_classes": """
from dataclasses import dataclass
from typing import ClassVar

from problems import Limit, Objective, PlanarArm
from solvers import Solver
from tpbso_casadi.scenario.model import TaskSection


class Own(BaseException):
    pass


class Refuses(Solver):
    def __init__(self, **settings):
        raise SystemExit(0)

    def search(self, box, rng, iterations):
        yield


@dataclass(frozen=True)
class Exits(Solver):
    population: int = 5

    def search(self, box, rng, iterations):
        yield box.sample(rng, 5)
        raise SystemExit(0)


@dataclass(frozen=True)
class Leaves(Exits):
    def search(self, box, rng, iterations):
        yield box.upper + box.sample(rng, 5)


@dataclass(frozen=True)
class Wrong(Exits):
    def search(self, box, rng, iterations):
        yield "candidates"


@dataclass(frozen=True)
class NoFile(Exits):
    def search(self, box, rng, iterations):
        open("/no/such/file")
        yield


@dataclass(frozen=True)
class Held(Limit):
    name: ClassVar[str] = "held"

    @classmethod
    def for_robot(cls, robot, obstacles):
        raise Own

    def constraints_at(self, samples, margin=0.0):
        return []


@dataclass(frozen=True)
class Nothing(Held):
    @classmethod
    def for_robot(cls, robot, obstacles):
        return cls()

    def constraints_at(self, samples, margin=0.0):
        return None


class Costly(Objective):
    def __init__(self):
        raise Own("no")


@dataclass(frozen=True)
class Arm(PlanarArm):
    @classmethod
    def from_settings(cls, settings):
        raise SystemExit("bye")


@dataclass(frozen=True)
class Lost(PlanarArm):
    @property
    def dof(self):
        raise RecursionError


class Chore(TaskSection):
    def build(self, robot, obstacles, model):
        raise SystemExit


class File(TaskSection):
    def with_files(self, folder):
        raise Own
""",
}
PLUGINS = [f"{module}:Any" for module in MODULES]
CLASSES = ["Refuses", "Exits", "Leaves", "Wrong", "NoFile", "Held", "Nothing", "Costly", "Arm", "Lost", "Chore", "File"]
PLUGINS += [f"hostile_classes:{name}" for name in (*CLASSES, "Own", "Missing")]
FILES = [f"{kind}.{suffix}" for kind in ("pipe", "folder", "circle") for suffix in ("toml", "html")]
FILES += ["socket.toml", "gone.toml", "binary.toml", "empty.toml"]
FILES += ["\udcff.toml", "[red].toml", "$a_b$.toml", "a\nb.toml", "huge.toml"]


def write_modules(folder: Path) -> None:
    """The plug-ins, in a folder to be put on the path of modules."""
    for name, text in MODULES.items():
        (folder / f"{name}.py").write_text(text)


def write_files(folder: Path, scenario: str) -> None:
    """Odd files, and a good scenario under odd names."""
    for suffix in ("toml", "html", "csv"):
        os.mkfifo(folder / f"pipe.{suffix}")
        (folder / f"folder.{suffix}").mkdir()
        (folder / f"circle.{suffix}").symlink_to(f"circle.{suffix}")
        (folder / f"gone.{suffix}").symlink_to("nowhere")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(os.path.relpath(folder / "socket.toml"))
    (folder / "cart.csv").write_text("t,x,y\n0,1.9,1.9\n1,1.8,1.9\n")
    (folder / "binary.toml").write_bytes(bytes(range(256)))
    (folder / "empty.toml").write_bytes(b"")
    with (folder / "huge.toml").open("wb") as file:
        file.truncate(10**12)  # without content
    for name in ("\udcff.toml", "[red].toml", "$a_b$.toml", "a\nb.toml", "good.toml"):
        (folder / name).write_text(scenario)
