"""``tp.repair``: what makes a motion hold that was judged and is not proven: less haste, if that is all it takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from problems import CertificateStatus, InvalidProblem, Verdict
from problems.base import shown_value
from problems.motions import JointPath
from tpbso_casadi.facade.arguments import in_words_of_python
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.surroundings import Content, scenario_around
from tpbso_casadi.planning import plan as plan_scenario
from tpbso_casadi.scenario import ScenarioError, motion_table, pieces_table

ACCURACY = 1e-4  # rad or m: how far a smooth path may be from lines between rows; a tenth of a millimetre at a metre
LEAST_SLOWING = 1.0 + 1e-12  # relative: what is no slower is the same motion


@dataclass(frozen=True)
class Repair:
    """The outcome of repairing a motion.

    Attributes:
        plan: the shortest motion that is proven, on the same path; the given one where that is; None where there is
            none.
        slowed: the motion as it is, run slower all along by the least factor with which the limits hold that time
            restores, proven or not; None where no factor does.
        factor: that of it.
        retimed: its path in the least time, from rest to rest, proven or not; None where it cannot be timed.
        to_move: where time alone does not help: what would have to be elsewhere, by how much, and when, a line each.
        words: what was tried and what came of it, a line each.
    """

    plan: Plan | None
    slowed: Plan | None = None
    factor: float = 1.0
    retimed: Plan | None = None
    to_move: tuple[str, ...] = ()
    words: tuple[str, ...] = field(default=(), repr=False)


def repair(checked: Plan, accuracy: float = ACCURACY) -> Repair:
    """Make a motion that was judged hold, by running it slower or by timing its path anew; its path stays.

    Where rows of positions alone make corners of it, the path is a smooth one within an accuracy of the lines between
    the rows, if there is one; the distance is proven, and said.

    Args:
        checked: what :func:`certify` returned.
        accuracy: of that, rad, or m where a joint slides.

    Raises:
        ScenarioError: it is no plan of one motion.
    """
    if not isinstance(checked, Plan) or checked.stages:
        raise ScenarioError(f"checked: what tp.certify returns is needed, not {shown_value(checked)}")
    if checked.certified:
        return Repair(checked, words=("nothing is to be repaired: all is proven",))
    with in_words_of_python():
        if has_corners(checked):
            slowed, factor, said = None, 1.0, "slower all along: no factor helps, as speeds jump where rows are joined"
            retimed, also_said = _smoothed(checked, accuracy)
        else:
            slowed, factor, said = _slowed(checked)
            retimed, also_said = _along_its_path(checked)
    proven = [plan for plan in (slowed, retimed) if plan is not None and plan.certified]
    best = min(proven, key=lambda plan: plan.duration, default=None)
    tried = [plan for plan in (slowed, retimed) if plan is not None] or [checked]
    to_move = () if best is not None else _to_move(checked, min(tried, key=lambda plan: len(_failed(plan))))
    return Repair(best, slowed, factor, retimed, to_move, (said, also_said, *_conclusion(checked, best, to_move)))


def has_corners(checked: Plan) -> bool:
    """Whether a motion is straight lines between rows."""
    pieces = checked.trajectory.coefficients
    return len(pieces) == 2 and pieces.shape[1] > 1


def _along_its_path(checked: Plan) -> tuple[Plan | None, str]:
    return _attempt("timed anew on its path", lambda: _planned(checked, pieces_table(JointPath.of(checked.trajectory))))


def _smoothed(checked: Plan, accuracy: float) -> tuple[Plan | None, str]:
    """The rows on a smooth path near the lines between them; where there is none, the lines, with stops at corners."""
    rows = checked.trajectory.at(checked.trajectory.breakpoints)
    task = {"kind": "joint-path", "joints": rows.tolist(), "interpolation": "fit", "tolerance": accuracy}
    what = f"timed anew on a smooth path near its rows, {accuracy:g} rad at most"
    found, said = _attempt(what, lambda: _planned(checked, task))
    if found is not None:
        away = next(verdict.worst for verdict in found.verdicts if verdict.name == "lines")
        return found, f"{said}; it is {abs(away):.3g} rad from the lines between them at most, proven"
    lines, also_said = _along_its_path(checked)
    return lines, f"{said}; another accuracy may do; {also_said}"


def _slowed(checked: Plan) -> tuple[Plan | None, float, str]:
    factor = checked.planned.criteria.safe_time_scale(checked.trajectory)
    if not factor > LEAST_SLOWING:
        return None, 1.0, "slower all along: no factor helps, as nothing that time restores is broken by its haste"
    motion = checked.trajectory.time_scaled(factor)
    left_out = {"without": getattr(checked.scenario.task, "without", [])}
    task = motion_table(motion, task=checked.motion.criteria.task) | left_out
    plan, said = _attempt(f"slower all along by {factor:.6g}", lambda: _planned(checked, task))
    return plan, factor, said


def _attempt(what: str, make: Callable[[], Plan]) -> tuple[Plan | None, str]:
    """A plan and what is to be said of it; None where it cannot be made."""
    try:
        plan = make()
    except (ScenarioError, InvalidProblem) as error:
        return None, f"{what}: cannot be made, {error}"
    names = ", ".join(verdict.name for verdict in _failed(plan))
    return plan, f"{what}: {plan.duration:.6g} s, {plan.status}" + (f" ({names})" if names else "")


def _planned(checked: Plan, task: Content) -> Plan:
    """The motion of another task in the same surroundings."""
    return Plan(plan_scenario(scenario_around(task, checked.scenario, None)))


def _failed(plan: Plan) -> list[Verdict]:
    return [verdict for verdict in plan.verdicts if not verdict.satisfied]


def _to_move(checked: Plan, tried: Plan) -> tuple[str, ...]:
    """Limits that neither the given motion nor another one on its path keeps: by how much, from when to when."""
    still = {verdict.name for verdict in _failed(tried)}
    spans = checked.motion.broken_spans
    lines = []
    for verdict in (verdict for verdict in _failed(checked) if verdict.name in still):
        when = ", ".join(f"{start:.4g} to {end:.4g} s" for start, end in spans.get(verdict.name, []))
        violated = verdict.status is CertificateStatus.VIOLATED
        much = f"by {verdict.excess:.6g} {verdict.unit}" if violated else "by what could not be decided"
        lines.append(f"{verdict.name}: {verdict.where}, {much}" + (f"; {when}" if when else ""))
    return tuple(lines)


def _conclusion(checked: Plan, best: Plan | None, to_move: tuple[str, ...]) -> tuple[str, ...]:
    if best is not None:
        return (f"repaired: {best.duration:.6g} s in place of {checked.duration:.6g} s, proven",)
    return ("time alone does not help; on this path would have to give way:", *to_move)
