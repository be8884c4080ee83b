"""Names of run folders that say what was run, and never those of another plan."""

from __future__ import annotations

import argparse
import re
from itertools import count
from pathlib import Path

from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.storage.run_folder import stored_content

RUNS = Path("runs")
LONGEST_NAME = 120  # characters
CHANGES = {  # what an option adds to the name
    "links": "{}-links",
    "objective": "{}",
    "elbow": "elbow-{}",
    "motion": "{}",
    "formulation": "{}",
    "knot_redundancy": "{}-redundancy",
    "population": "population-{}",
    "iterations": "{}-iterations",
    "evaluations": "{}-evaluations",
    "time_limit": "{:g}-s",
    "within": "within-{:g}-s",
    "polish_starts": "polish-{}",
}


def run_folder(options: argparse.Namespace, scenario: Scenario) -> Path:
    """``runs/SCENARIO-SOLVER-SEED``, and what the command line changes; with a number where that is another plan's."""
    parts = [Path(options.scenario).stem]
    parts += [_word(scenario.solver.name), str(scenario.solver.seed)] if scenario.task.is_searched else []
    for option, form in CHANGES.items():
        value = getattr(options, option)
        if value is not None:
            parts.append(form.format(_word(value) if isinstance(value, str) else value))
    if options.retime is not None:
        parts.append("retimed" if options.retime else "not-retimed")
    if options.polish and options.polish_starts is None:
        parts.append("polish")
    return free_folder("-".join(parts), scenario)


def free_folder(name: str, scenario: Scenario) -> Path:
    """The folder of that name among the runs, with a number where it is another plan's."""
    name = re.sub(r"[^\w.+-]+", "_", name)[:LONGEST_NAME]
    numbered = (RUNS / (name if number == 1 else f"{name}-{number}") for number in count(1))
    return next(folder for folder in numbered if _is_free(folder, scenario))


def _word(name: str) -> str:
    """The class of a plug-in's ``package.module:Class``."""
    return name.rsplit(":", maxsplit=1)[-1]


def _is_free(folder: Path, scenario: Scenario) -> bool:
    """Whether there is nothing, or the same plan."""
    if not folder.exists() and not folder.is_symlink():
        return True
    return stored_content(folder).get("scenario") == scenario.model_dump(mode="json")
