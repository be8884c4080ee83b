"""Motions of other libraries as exact polynomial pieces, recognised by what they have, not by their classes.

SciPy's piecewise polynomials and splines; TOPP-RA's splines and its paths of constant acceleration along them; Drake's
piecewise polynomials and B-splines; Ruckig's profiles. What was taken from the inside of an object is held against what
the object itself evaluates to, at many times.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems import Trajectory
from problems.base import FloatArray, composition, shown_value, taylor_coefficients
from tpbso_casadi.scenario import ScenarioError

TIMES = 101  # at which pieces and object are compared
SAME = 1e-9  # of the largest value; allows for rounding only
SLIVER = 1e-12  # s: a piece that is shorter than what rounding leaves of the crossing of two breakpoints


def exact_pieces(motion: Any) -> tuple[Trajectory, float] | None:
    """The pieces of a motion of another library, and the time at which they begin there, s.

    None where it is nothing of that kind.

    Raises:
        ScenarioError: it is, but its pieces are not those of joints over time, or do not give what it evaluates to; or
            it is a motion whose pieces are not known.
    """
    for has, pieces_of, evaluate in KINDS:
        if all(hasattr(motion, name) for name in has):
            try:
                found, values = pieces_of(motion), evaluate
            except (AttributeError, TypeError, ValueError, IndexError, RuntimeError) as error:
                reason = f"the pieces of this {type(motion).__name__} cannot be read: {error}"
                raise ScenarioError(f"trajectory: {reason}") from error
            return _checked(motion, found, values)
    if callable(motion) or hasattr(motion, "value"):
        raise ScenarioError(
            f"trajectory: the pieces of {shown_value(motion)} are not known; sample it, and give the rows"
        )
    return None


def _checked(
    motion: Any, found: scipy.interpolate.PPoly, evaluate: Callable[[Any, float], Any]
) -> tuple[Trajectory, float]:
    """The motion, and when it begins, if it is one of joints and evaluates to the same as the object.

    Raises:
        ScenarioError: it is none, or does not.
    """
    coefficients, times = np.asarray(found.c, dtype=np.float64), np.asarray(found.x, dtype=np.float64)
    name = type(motion).__name__
    if coefficients.ndim != 3 or not coefficients.size or not np.isfinite(coefficients).all():
        raise ScenarioError(f"trajectory: a {name} of finite values (joints,) is needed, not {coefficients.shape[2:]}")
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise ScenarioError(f"trajectory: the breakpoints of this {name} do not increase")
    trajectory = Trajectory(times - times[0], coefficients)
    lasts = _lasting(motion, trajectory.duration)
    if not abs(lasts - trajectory.duration) <= SAME * max(1.0, lasts):
        raise ScenarioError(f"trajectory: the pieces of this {name} last {trajectory.duration:g} s, itself {lasts:g} s")
    at = np.linspace(times[0], times[-1], TIMES)
    expected = np.array([np.asarray(evaluate(motion, float(time)), dtype=np.float64).ravel() for time in at])
    away = np.abs(trajectory.at(at - times[0]) - expected).max()
    if not away <= SAME * max(1.0, float(np.abs(expected).max())):
        raise ScenarioError(f"trajectory: the pieces of this {name} are {away:.2g} away from what it evaluates to")
    return trajectory, float(times[0])


def _lasting(motion: Any, usual: float) -> float:
    """How long an object says that it lasts, s; as usual where it does not."""
    if hasattr(motion, "start_time") and hasattr(motion, "end_time"):
        return float(motion.end_time() - motion.start_time())
    stated = getattr(motion, "duration", usual)
    return usual if callable(stated) else float(stated)


def _called(motion: Any, time: float) -> Any:
    return motion(time)


def _valued(motion: Any, time: float) -> Any:
    return motion.value(time)


def _own_pieces(motion: Any) -> scipy.interpolate.PPoly:
    return scipy.interpolate.PPoly(motion.c, motion.x)


def _of_b_spline(motion: Any) -> scipy.interpolate.PPoly:
    return _between_knots(scipy.interpolate.BSpline(motion.t, motion.c, motion.k))


def _between_knots(spline: scipy.interpolate.BSpline) -> scipy.interpolate.PPoly:
    """A spline by its Taylor coefficients at its knots, each taken once."""
    k = spline.k
    knots = np.unique(spline.t[k : len(spline.t) - k])
    return scipy.interpolate.PPoly(taylor_coefficients(spline, knots[:-1], k), knots)


def _toppra_spline(motion: Any) -> scipy.interpolate.PPoly:
    return scipy.interpolate.PPoly(motion.cspl.c, motion.cspl.x)


def _toppra_constant_acceleration(motion: Any) -> scipy.interpolate.PPoly:
    """A spline along which the parameter has piecewise constant acceleration."""
    accelerations, speeds, starts = (np.asarray(part)[None] for part in (motion._us, motion._velocities, motion._ss))
    law = np.concatenate([accelerations / 2.0, speeds[:, :-1], starts[:, :-1]])
    return _composed(_toppra_spline(motion._path), scipy.interpolate.PPoly(law, motion._ts))


def _composed(path: scipy.interpolate.PPoly, law: scipy.interpolate.PPoly) -> scipy.interpolate.PPoly:
    """A path run by a law of its parameter, piece by piece: law (order, pieces) of time, never going back."""
    cuts = [law.x]
    for knot in path.x[1:-1]:
        roots = law.solve(knot, discontinuity=False, extrapolate=False)
        cuts.append(roots[np.isfinite(roots)])
    times = np.unique(np.concatenate(cuts))
    times = times[np.append(np.diff(times) > SLIVER, True)]
    times[0] = law.x[0]
    middles = (times[1:] + times[:-1]) / 2.0
    piece = np.clip(np.searchsorted(path.x, law(middles), side="right") - 1, 0, len(path.x) - 2)
    orders = range(law.c.shape[0])
    factorials = np.cumprod([1.0, *range(1, law.c.shape[0])])
    laws = scipy.interpolate.PPoly(law.c, law.x)
    which = np.searchsorted(law.x[1:-1], middles, side="right")
    offsets = times[:-1] - law.x[which]
    inner = np.stack([_taylor(laws.c[:, which], offsets, order) / factorials[order] for order in orders])[:, :, None]
    inner[0, :, 0] -= path.x[piece]
    outer = path.c[::-1, piece]
    return scipy.interpolate.PPoly(composition(np.asarray(outer), inner)[::-1], times)


def _taylor(coefficients: FloatArray, offsets: FloatArray, order: int) -> FloatArray:
    """A derivative of polynomials (n, p), highest power first, at offsets (p,)."""
    powers = coefficients[::-1]
    for _ in range(order):
        powers = powers[1:] * np.arange(1, len(powers))[:, None]
    return np.asarray(sum(row * offsets**power for power, row in enumerate(powers)))


def _drake_polynomials(motion: Any) -> scipy.interpolate.PPoly:
    times = np.array(motion.get_segment_times())
    matrices = [motion.getPolynomialMatrix(piece) for piece in range(len(times) - 1)]
    entries = [[entry.GetCoefficients() for entry in np.asarray(matrix).ravel()] for matrix in matrices]
    order = max(len(entry) for piece in entries for entry in piece)
    coefficients = np.zeros((order, len(entries), len(entries[0])))
    for piece, row in enumerate(entries):
        for joint, entry in enumerate(row):
            coefficients[order - len(entry) :, piece, joint] = entry[::-1]
    return scipy.interpolate.PPoly(coefficients, times)


def _drake_b_spline(motion: Any) -> scipy.interpolate.PPoly:
    basis, points = motion.basis(), np.array([np.ravel(point) for point in motion.control_points()])
    return _between_knots(scipy.interpolate.BSpline(np.array(basis.knots()), points, basis.order() - 1))


def _drake_path_over_time(motion: Any) -> scipy.interpolate.PPoly:
    """A path run by a law of its parameter, each of them polynomials or a B-spline."""
    path, law = (_any_of_drake(part) for part in (motion.path(), motion.time_scaling()))
    return _composed(path, scipy.interpolate.PPoly(law.c[:, :, 0], law.x))


def _any_of_drake(motion: Any) -> scipy.interpolate.PPoly:
    return _drake_b_spline(motion) if hasattr(motion, "basis") else _drake_polynomials(motion)


def _ruckig_profiles(motion: Any) -> scipy.interpolate.PPoly:
    """The brake and the seven phases of constant jerk of each joint, section after section."""
    starts = [0.0, *list(motion.intermediate_durations)[:-1]]
    curves: list[list[tuple[float, FloatArray]]] = [[] for _ in range(motion.degrees_of_freedom)]
    for start, section in zip(starts, motion.profiles, strict=True):
        for joint, profile in enumerate(section):
            curves[joint] += _phases(start, profile)
    begins = [time for curve in curves for time, _ in curve]
    times = np.unique(np.minimum([0.0, motion.duration, *begins], motion.duration))
    times = times[np.append(np.diff(times) > SLIVER, True)]
    coefficients = np.zeros((4, len(times) - 1, len(curves)))
    for joint, curve in enumerate(curves):
        starting = np.array([time for time, _ in curve])
        which = np.searchsorted(starting, (times[1:] + times[:-1]) / 2.0, side="right") - 1
        table = np.array([state for _, state in curve])[which].T  # jerk / 6, acceleration / 2, speed, position
        offsets = times[:-1] - starting[which]
        for row, (order, factor) in enumerate(((3, 6.0), (2, 2.0), (1, 1.0), (0, 1.0))):
            coefficients[row, :, joint] = _taylor(table, offsets, order) / factor
    return scipy.interpolate.PPoly(coefficients, times)


def _phases(start: float, profile: Any) -> list[tuple[float, FloatArray]]:
    """When phases of a profile begin, s, and the cubics of each, (4,), highest power first."""
    time, found = start, []
    brake = profile.brake
    for duration, jerk, acceleration, speed, position in zip(brake.t, brake.j, brake.a, brake.v, brake.p, strict=True):
        if duration > 0.0:
            found.append((time, np.array([jerk / 6.0, acceleration / 2.0, speed, position])))
            time += duration
    states = zip([*profile.t, np.inf], [*profile.j[:7], 0.0], profile.a, profile.v, profile.p, strict=True)
    for duration, jerk, acceleration, speed, position in states:
        if duration > 0.0:
            found.append((time, np.array([jerk / 6.0, acceleration / 2.0, speed, position])))
            time += duration
    return found


def _ruckig_at(motion: Any, time: float) -> Any:
    return motion.at_time(time)[0]


KINDS: tuple[tuple[tuple[str, ...], Callable[[Any], scipy.interpolate.PPoly], Callable[[Any, float], Any]], ...] = (
    (("getPolynomialMatrix", "get_segment_times"), _drake_polynomials, _valued),
    (("basis", "control_points"), _drake_b_spline, _valued),
    (("path", "time_scaling", "value"), _drake_path_over_time, _valued),
    (("profiles", "at_time", "intermediate_durations"), _ruckig_profiles, _ruckig_at),
    (("cspl", "duration"), _toppra_spline, _called),
    (("_path", "_ss", "_ts", "_us", "_velocities"), _toppra_constant_acceleration, _called),
    (("c", "x"), _own_pieces, _called),
    (("c", "t", "k"), _of_b_spline, _called),
)  # what a kind has, its pieces, and what it evaluates to
