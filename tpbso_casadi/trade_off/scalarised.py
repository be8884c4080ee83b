"""A front by one plan after the other, each begun from the plans that lie beside it."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from tpbso_casadi.planning.plan import plan
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.storage.run_folder import write_run
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.placement import ENDS, Placement
from tpbso_casadi.trade_off.point import Point, Request
from tpbso_casadi.trade_off.store import POINTS
from tpbso_casadi.trade_off.work import Method, Work


@dataclass(frozen=True)
class Scalarised(Method):
    """One objective out of two, again and again.

    Args:
        placement: says what to make next.
    """

    placement: Placement

    def run(self, work: Work) -> None:
        """Make one plan after the other; each is stored the moment it is complete.

        Nothing more is placed where one of the ends is not certified: there is no front between them.
        """
        while not work.interruption.requested:
            points = work.store.points(self.name)
            if not all(point.certified for point in points[: len(ENDS)]):
                return
            request = self.placement.next(points)
            point = None if request is None else _planned(request, points, work)
            if point is None:
                return
            work.store.add(self.name, point)
            work.told(point)


def _planned(request: Request, points: Sequence[Point], work: Work) -> Point | None:
    """The plan of a request, written to its folder; None where Ctrl-C cut it short."""
    began, number = time.perf_counter(), len(points) + 1
    scenario = work.objectives.asked_for(request)
    starts = [work.store.trajectory(points[start - 1]) for start in request.starts]
    found = work.interruption.attempt(
        partial(plan, scenario, _numbered(number, work.progress), work.evaluation, starts=starts)
    )
    if found is None or found.interrupted:
        return None
    folder = f"{POINTS}/{number:02d}-{_label(request, work.objectives)}"
    write_run(work.store.folder / folder, found, work.plots, interruption=work.interruption, formats=work.formats)
    return Point(
        number=number,
        request=request,
        values=work.objectives.values(found.criteria, found.trajectory, found.times),
        duration=found.trajectory.duration,
        certified=found.feasible,
        seed=scenario.solver.seed,
        evaluations=_evaluations(found),
        seconds=time.perf_counter() - began,
        folder=folder,
    )


def _evaluations(found: PlannedMotion) -> int:
    return 0 if found.searched is None else found.searched.search.evaluations


def _numbered(number: int, progress: Progress) -> Progress:
    """The same progress, which says of which point it is."""
    return Progress(progress.status, lambda name: progress.phase(f"point {number}: {name}"))


def _label(request: Request, objectives: Objectives) -> str:
    """What a folder is called after its number."""
    asked = request.scalarisation
    parts = [name.rsplit(":")[-1] for name, weight in zip(objectives.names, asked.weights, strict=True) if weight]
    parts += [f"weight-{asked.weights[1]:.4g}"] * all(asked.weights)
    parts += [] if asked.longest is None else [f"within-{asked.longest:.4g}-s"]
    parts += ["again"] * (request.attempt > 0)
    return re.sub(r"[^\w.+-]+", "_", "-".join(parts))
