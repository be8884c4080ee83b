"""The fastest profile of the path's speed: linear programs over the squares of speeds.

Between two grid points b is linear, so that velocity squared q'^2 b and acceleration q' b'/2 + q'' b are polynomials
whose Bernstein coefficients are linear in the two values of b. If every coefficient keeps the limit, the polynomial
does.

Between two grid points du/dt changes at a constant rate in time, so that u is quadratic and q(u(t)) a polynomial in t.

Between two grid points b is linear and m, c and g are nearly parabolas, drawn through three nodes; the torque is then
a polynomial whose Bernstein coefficients are linear in the two values of b. What viscous friction takes grows with the
root of b, which is linear around the squares that are expected.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from problems.base import FloatArray, InvalidProblem, composition, derivative, in_bernstein_form, product
from problems.core import LinearProgram, SingleRows, WholeRows
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits
from problems.timing.prepared import PathTorques, PreparedPath
from problems.timing.settings import DEFAULT_RETIMING, ProfileSettings


@dataclass(frozen=True)
class Intervals:
    """A path over the intervals of a grid.

    Args:
        nodes: N + 1 increasing parameters, every breakpoint of the path among them.
        local: lowest power first, (order, N, k), rad; each interval over [0, 1].
    """

    nodes: FloatArray
    local: FloatArray

    @classmethod
    def of(cls, path: JointPath, nodes: FloatArray) -> Intervals:
        """Expand each piece of the path around the start of each interval in it."""
        piece = np.searchsorted(path.breakpoints, (nodes[:-1] + nodes[1:]) / 2.0) - 1
        ascending = path.coefficients[::-1][:, piece]
        order, start, length = len(ascending), nodes[:-1] - path.breakpoints[piece], np.diff(nodes)
        local = np.zeros_like(ascending)
        for n in range(order):
            for m in range(n, order):
                local[n] += comb(m, n) * ascending[m] * (start ** (m - n))[:, None]
            local[n] *= (length**n)[:, None]
        return cls(nodes, local)

    @property
    def lengths(self) -> FloatArray:
        """Lengths of the intervals in the parameter, (N,)."""
        return np.diff(self.nodes)


def limit_rows(intervals: Intervals, limits: JointLimits, steady_jerk: float) -> FloatArray:
    """Coefficients (N, rows, 2): for each interval and row, their product with b at its two ends must be <= 1.

    Jerk is not linear in b: a share of its limit bounds what the path needs at constant du/dt, d3q/du3 b^(3/2).
    """
    speed, acceleration, *jerks = (bound[:, None] for bound in limits.by_order)
    first = derivative(intervals.local)
    velocity = weighted(product(first, first))
    bend = weighted(derivative(first))
    change = np.zeros_like(bend)
    change[: len(first)] = 0.5 * first[..., None] * np.array([-1.0, 1.0])
    scale = intervals.lengths[:, None, None] ** 2
    bent = in_bernstein_form((bend + change) / (scale * acceleration))
    rows = np.concatenate([in_bernstein_form(velocity / (scale * speed**2)), bent, -bent])
    linear = rows.transpose(1, 0, 2, 3).reshape(scale.size, -1, 2)
    third = derivative(derivative(first)) / intervals.lengths[:, None] ** 3
    needed = [np.abs(in_bernstein_form(third)).max(axis=0) / (steady_jerk * jerk[:, 0]) for jerk in jerks]
    steady = [(share.max(axis=1) ** (2.0 / 3.0))[:, None, None] * np.eye(2) for share in needed]
    return np.concatenate([linear, *steady], axis=1)


def ceiling_rows(ceiling: FloatArray) -> FloatArray:
    """Rows (N, 2, 2) that keep b below a ceiling (N + 1,); none where that is zero, as at ends at rest."""
    shares = np.divide(1.0, ceiling, out=np.zeros_like(ceiling), where=ceiling > 0.0)
    return np.asarray(np.stack([shares[:-1], shares[1:]], axis=1)[:, :, None] * np.eye(2))


def weighted(ascending: FloatArray) -> FloatArray:
    """Polynomials (n, N, k) in w times 1 - w, and times w: (n + 1, N, k, 2)."""
    padded = np.pad(ascending, ((0, 1), (0, 0), (0, 0)))
    later = np.roll(padded, 1, axis=0)
    return np.stack([padded - later, later], axis=-1)


def necessary(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The rows that are not redundant where both values of b are positive, by gift wrapping, all intervals at once.

    A row is redundant unless its coefficients are a corner of the convex hull of all, seen from above right.

    Args:
        rows: (N, rows, 2).

    Returns:
        The interval of each row kept, and its coefficients (kept, 2).
    """
    one, other = (np.ascontiguousarray(rows[..., end]) for end in (0, 1))
    active = np.arange(len(rows))
    best = _lexicographic(one, other)
    chosen = []
    while True:
        last = one[np.arange(active.size), best], other[np.arange(active.size), best]
        chosen.append((active, np.stack(last, axis=1)))
        rising = last[1] < other.max(axis=1)
        if not rising.any():
            return np.concatenate([each[0] for each in chosen]), np.concatenate([each[1] for each in chosen])
        active, one, other = active[rising], one[rising], other[rising]
        across, up = last[0][rising, None] - one, other - last[1][rising, None]
        slope = np.divide(across, up, out=np.full_like(up, np.inf), where=up > 0.0)  # what a step up costs
        best = _lexicographic(-slope, up)


def _lexicographic(first: FloatArray, second: FloatArray) -> FloatArray:
    """Columns in which the first (n, m) is largest in each row, of several the one in which the second is."""
    best = first.argmax(axis=1)
    ties = np.flatnonzero((first == np.take_along_axis(first, best[:, None], 1)).sum(axis=1) > 1)
    most = first[ties].max(axis=1, keepdims=True)
    best[ties] = np.where(first[ties] == most, second[ties], -np.inf).argmax(axis=1)
    return np.asarray(best)


@dataclass(frozen=True)
class SpeedProfile:
    """The squared speed of a path parameter.

    Args:
        nodes: N + 1 increasing parameters.
        squares: (du/dt)^2 there, (N + 1,), of two neighbours one at least positive.
    """

    nodes: FloatArray
    squares: FloatArray

    @property
    def durations(self) -> FloatArray:
        """Durations of the intervals, (N,), s."""
        speed = np.sqrt(self.squares)
        return np.asarray(2.0 * np.diff(self.nodes) / (speed[:-1] + speed[1:]))

    @property
    def times(self) -> FloatArray:
        """Times at which the nodes are passed, (N + 1,), s."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def seen_from(self, parameter: float) -> SpeedProfile:
        """The profile over a parameter that is 0 at a given one."""
        return SpeedProfile(self.nodes - parameter, self.squares)

    def parameters(self, times: FloatArray) -> FloatArray:
        """The parameters u at times (n,) in s, from 0 to the end."""
        nodes_at, speed = self.times, np.sqrt(self.squares)
        interval = np.clip(np.searchsorted(nodes_at, times, "right") - 1, 0, self.durations.size - 1)
        share = np.clip((times - nodes_at[interval]) / self.durations[interval], 0.0, 1.0)
        linear, quadratic = (part[interval] for part in _course(speed))
        return np.asarray(self.nodes[interval] + np.diff(self.nodes)[interval] * share * (linear + quadratic * share))

    def trajectory(self, intervals: Intervals) -> Trajectory:
        """The motion along a path, expanded over this profile's intervals: polynomials of twice its degree."""
        linear, quadratic = _course(np.sqrt(self.squares))
        w = np.stack([np.zeros_like(linear), linear, quadratic])[:, :, None]
        scaled = composition(intervals.local, w)
        powers = np.arange(len(scaled))[:, None]
        return Trajectory(self.times, (scaled / (self.durations**powers)[..., None])[::-1])


def _course(speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two coefficients of the share of an interval that is done, in the share of its duration, (N,) each."""
    total = speed[:-1] + speed[1:]
    return 2.0 * speed[:-1] / total, np.diff(speed) / total


NODE_SHARES = (1.0 - np.cos(np.pi * (np.arange(3) + 0.5) / 3.0)) / 2.0  # of an interval
EXAMINED_SHARES = np.linspace(0.0, 1.0, 5)  # of an interval of a finished profile


def torque_rows(
    motors: PathTorques, intervals: Intervals, expected: FloatArray, resting: FloatArray, most_viscous: float
) -> FloatArray:
    """Coefficients (N, rows, 2): for each interval and row, their product with b at its two ends must be <= 1.

    Args:
        motors: of the path.
        intervals: of the path.
        expected: squares (N + 1,), around which viscous friction is linear.
        resting: whether b is zero, (N + 1,).
        most_viscous: share of the rest of a limit that viscous friction takes, at most, where b is zero.
    """
    u = intervals.nodes[:-1] + NODE_SHARES[:, None] * intervals.lengths
    inertia, bend, gravity = motors.at(u)
    viscous = motors.viscous * motors.path.at(u, 1)
    high, low = _friction(motors, intervals, resting)
    above = _one_sided(motors, intervals, expected, (inertia, bend, gravity + high, viscous), most_viscous)
    below = _one_sided(motors, intervals, expected, (-inertia, -bend, -gravity - low, -viscous), most_viscous)
    return np.concatenate([above, below]).transpose(1, 0, 2, 3).reshape(len(intervals.lengths), -1, 2)


def _one_sided(
    motors: PathTorques,
    intervals: Intervals,
    expected: FloatArray,
    terms: tuple[FloatArray, ...],
    most_viscous: float,
) -> FloatArray:
    """Rows (n, N, k, 2) with which torques stay below their bounds; m, c, g and viscous friction at the nodes."""
    inertia, bend, holding, viscous = terms
    least = motors.settings.least_left * motors.bound
    left = np.maximum(motors.bound - holding, least)
    if motors.viscous.any():
        smallest = motors.settings.least_left * expected.max()
        slope, taken = _viscous(viscous, np.maximum(expected, smallest), left, most_viscous)
        bend, left = bend + slope, left - taken
    left = in_bernstein_form(np.pad(_through(left), ((0, 1), (0, 0), (0, 0))))
    row = weighted(_through(bend))
    row[:-1] += _through(inertia)[..., None] * np.array([-1.0, 1.0]) / (2.0 * intervals.lengths[:, None, None])
    return np.asarray(in_bernstein_form(row) / np.maximum(left, least)[..., None])


def profile_time_scale(motors: PathTorques, profile: SpeedProfile) -> float:
    """How many times slower a profile has to be run for its torques, at samples between its nodes."""
    lengths, squares = np.diff(profile.nodes)[:, None], profile.squares
    u = np.minimum(profile.nodes[:-1, None] + EXAMINED_SHARES * lengths, np.nextafter(profile.nodes[1:, None], 0.0))
    rate = np.sqrt(squares[:-1, None] + EXAMINED_SHARES * np.diff(squares)[:, None])
    change = np.broadcast_to(np.diff(squares)[:, None] / (2.0 * lengths), u.shape)
    return motors.time_scale(u.ravel(), rate.ravel(), change.ravel())


def _friction(motors: PathTorques, intervals: Intervals, resting: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The most and the least that Coulomb friction can take in each interval, (N, k)."""
    slopes = in_bernstein_form(derivative(intervals.local[..., : motors.coulomb.size]))
    stops = np.logical_or(resting[:-1], resting[1:])[:, None]
    high = np.where((slopes.max(axis=0) < 0.0) & ~stops, -1.0, 1.0)
    low = np.where((slopes.min(axis=0) > 0.0) & ~stops, 1.0, -1.0)
    return high * motors.coulomb, low * motors.coulomb


def _viscous(
    factor: FloatArray, expected: FloatArray, left: FloatArray, most_viscous: float
) -> tuple[FloatArray, FloatArray]:
    """Viscous friction at the nodes, (3, N, k): its growth with b, and its value where b is zero.

    A root lies below its tangents, and above its chord where b is between the two squares that are expected.
    """
    with np.errstate(divide="ignore"):
        most = 2.0 * most_viscous * left / np.abs(factor)
    roots = np.sqrt(expected)[:, None]
    total, middle = roots[:-1] + roots[1:], np.sqrt((roots[:-1] ** 2 + roots[1:] ** 2) / 2.0)
    tangent = np.minimum(middle, most)
    slope = np.where(factor > 0.0, 1.0 / (2.0 * tangent), 1.0 / total)
    return factor * slope, factor * np.where(factor > 0.0, tangent / 2.0, roots[:-1] * roots[1:] / total)


def _through(values: FloatArray) -> FloatArray:
    """Parabolas, lowest power first, through values (3, N, ...) at the nodes."""
    flat = np.linalg.solve(np.vander(NODE_SHARES, increasing=True), values.reshape(3, -1))
    return np.asarray(flat.reshape(values.shape))


NODE_ROUNDING = 1e-9  # of a piece: nodes nearer to a breakpoint are left out


def fastest_profile(
    prepared: PreparedPath,
    limits: JointLimits,
    motors: PathTorques | None = None,
    ceiling: SpeedProfile | None = None,
    rough: bool = False,
    settings: ProfileSettings = DEFAULT_RETIMING.profile,
) -> tuple[SpeedProfile, Intervals]:
    """The fastest profile on a grid of about equal times, and the path over that grid.

    Jerk limits are kept where the speed is steady.

    Args:
        prepared: the path.
        limits: of its joints.
        motors: torques along it; None where they do not count.
        ceiling: a profile that is not exceeded; none where None.
        rough: whether a search only begins at the profile.
        settings: of the grid and its programs.

    Raises:
        InvalidProblem: the limits allow no motion with the velocities that the ends have to have.
    """
    breakpoints = prepared.path.breakpoints
    share = settings.rough_share if rough else 1.0
    wanted: float = max(settings.intervals_per_piece * (breakpoints.size - 1), settings.fewest_intervals)
    first = int(settings.first_share * share * min(wanted, settings.enough_intervals))
    nodes = _subdivided(breakpoints, breakpoints, first, settings.least_in_piece)
    intervals = Intervals.of(prepared.path, nodes)
    problem = ProfileProblem(prepared, limits, motors, ceiling, rough, settings)
    profile = problem.solved(intervals, None)
    if not prepared.moves_at_an_end:  # else nothing can be slowed afterwards
        needed = settings.intervals_per_rise * rises(limits, float(profile.times[-1]))
        wanted = min(wanted, max(needed, settings.enough_intervals))
    count = int(share * min(wanted, settings.most_intervals))
    nodes = _equal_times(profile, breakpoints, count, prepared.resting, settings)
    intervals = Intervals.of(prepared.path, nodes)
    for _ in range(1 if motors is None or not motors.viscous.any() else settings.viscous_rounds):
        expected = np.interp(nodes, profile.nodes, profile.squares)
        profile = problem.solved(intervals, expected)
    return profile, intervals


def rises(limits: JointLimits, duration: float) -> float:
    """How many times the quickest joint could come from rest to its largest speed in a duration in s."""
    speed, acceleration = limits.by_order[:2]
    limited = np.isfinite(acceleration)
    return float(duration * (acceleration / speed)[limited].max())


def _subdivided(breakpoints: FloatArray, measure: FloatArray, count: int, least_in_piece: int) -> FloatArray:
    """Nodes of about so many intervals, equal within each piece, which has its share of a measure (p + 1,)."""
    shares = np.diff(measure) / (measure[-1] - measure[0])
    counts = np.maximum(least_in_piece, np.ceil(count * shares)).astype(int)
    inner = [
        start + (end - start) * np.arange(n) / n
        for start, end, n in zip(breakpoints[:-1], breakpoints[1:], counts, strict=True)
    ]
    return np.concatenate([*inner, breakpoints[-1:]])


def _equal_times(
    profile: SpeedProfile, breakpoints: FloatArray, count: int, graded: tuple[bool, bool], settings: ProfileSettings
) -> FloatArray:
    """Nodes at about equal times within each piece, the breakpoints among them."""
    passed = profile.times[np.searchsorted(profile.nodes, breakpoints)]
    times = _subdivided(passed, passed, count, settings.least_in_piece)
    if graded[0]:
        times = _graded(times, settings)
    if graded[1]:
        times = -_graded(-times[::-1], settings)[::-1]
    nodes = profile.parameters(times)
    after = np.searchsorted(breakpoints, nodes).clip(1, breakpoints.size - 1)
    apart = np.minimum(nodes - breakpoints[after - 1], breakpoints[after] - nodes)
    inner = nodes[apart > NODE_ROUNDING * (breakpoints[after] - breakpoints[after - 1])]
    return np.union1d(inner, breakpoints)


def _graded(times: FloatArray, settings: ProfileSettings) -> FloatArray:
    """Times with shorter intervals at the start, for a path whose q' is zero there: b is large and steep."""
    last = min(settings.graded_intervals, times.size - 1)
    count = settings.grading * last
    return np.concatenate([times[0] + (times[last] - times[0]) * (np.arange(count) / count) ** 2, times[last:]])


@dataclass(frozen=True, eq=False)
class ProfileProblem:
    """The linear programs of the fastest profile of one path.

    Args:
        prepared: the path.
        limits: of its joints.
        motors: torques along it; None where they do not count.
        ceiling: a profile that is not exceeded; none where None.
        rough: whether a search only begins at the profile.
        settings: of the programs.
    """

    prepared: PreparedPath
    limits: JointLimits
    motors: PathTorques | None
    ceiling: SpeedProfile | None
    rough: bool
    settings: ProfileSettings

    def solved(self, intervals: Intervals, expected: FloatArray | None) -> SpeedProfile:
        """The profile of least time, to first order around the squares that are expected, (N + 1,); or about equal."""
        fixed = self._fixed(intervals.nodes)
        every_row = limit_rows(intervals, self.limits, self.settings.steady_jerk)
        if self.ceiling is not None:
            below = np.interp(intervals.nodes, self.ceiling.nodes, self.ceiling.squares)
            every_row = np.append(every_row, ceiling_rows(below), axis=1)
        if self.motors is not None:
            around = self._largest(every_row, fixed) if expected is None else expected
            rows = torque_rows(self.motors, intervals, around, fixed == 0.0, self.settings.most_viscous)
            every_row = np.append(every_row, rows, axis=1)
        scale = self._largest(every_row, fixed)
        if expected is None:
            expected = np.maximum(1.0, scale / (self.settings.unbounded * scale.min()))
        interval, rows = necessary(every_row)
        solution = self._maximised(_savings(intervals, expected) * scale, interval, rows, scale, fixed)
        if solution is not None:
            return SpeedProfile(intervals.nodes, solution)
        if np.nanmax(fixed, initial=0.0) > 0.0:
            raise InvalidProblem("rates", "the limits allow no motion along the path with these velocities at its ends")
        shape = np.where(np.isnan(fixed), 1.0, 0.0)
        most = (rows[:, 0] * shape[interval] + rows[:, 1] * shape[interval + 1]).max()
        return SpeedProfile(intervals.nodes, shape / most)

    def _fixed(self, nodes: FloatArray) -> FloatArray:
        """The squares that are given, (N + 1,): at corners and at ends where q' is not zero; else nan."""
        prepared, fixed = self.prepared, np.full(nodes.size, np.nan)
        fixed[np.searchsorted(nodes, prepared.path.breakpoints[prepared.corners])] = 0.0
        for end, resting, rate in zip((0, -1), prepared.resting, prepared.rates, strict=True):
            if not resting:
                fixed[end] = rate**2
        return fixed

    def _largest(self, rows: FloatArray, fixed: FloatArray) -> FloatArray:
        """The largest value of each square, (N + 1,), that single rows (N, rows, 2) allow."""
        unbounded, width = self.settings.unbounded, 2 * self.settings.neighbours + 1
        bounding = np.minimum(rows[..., 0], rows[..., 1]) >= 0.0
        left, right = (np.where(bounding, rows[..., end], 0.0).max(axis=1) for end in (0, 1))
        tightest = np.maximum(np.append(left, 0.0), np.insert(right, 0, 0.0))
        padded = np.pad(tightest, width // 2, mode="edge")
        around = np.lib.stride_tricks.sliding_window_view(padded, width).max(axis=1)
        near = np.maximum(around, tightest.max() / unbounded**3)
        scale = 1.0 / np.maximum(tightest, near / unbounded)
        return np.asarray(np.where(fixed > 0.0, fixed, scale))

    def _maximised(
        self, weights: FloatArray, interval: FloatArray, rows: FloatArray, scale: FloatArray, fixed: FloatArray
    ) -> FloatArray | None:
        """The squares (N + 1,) with the largest weighted sum of their shares of the scale; None where there are none.

        Squares may be a million times smaller than others: the core, which is accurate to a share of the sum, is for
        profiles that are improved afterwards.
        """
        columns = np.stack([interval, interval + 1], axis=1)
        moving = np.nanmax(fixed, initial=0.0) > 0.0
        none = np.zeros(len(rows))
        single = SingleRows(
            joint=np.zeros(len(rows), dtype=np.intp),
            first=interval.astype(np.intp),
            weights=rows * scale[columns],
            by_time=none,
            bound=self._bounds_of_rows(rows, columns, fixed) if moving else none + 1.0,
        )
        given = fixed / scale
        lower, upper = np.nan_to_num(given, nan=0.0), np.where(np.isnan(given), 1.0, given)
        cost = -weights[:, None] / weights.max()
        program = LinearProgram(single, WholeRows.none(2, 1), lower[:, None], upper[:, None], (0.0, 0.0), cost)
        solution = program.solved() if self.rough and not moving else None
        solution = program.by_highs() if solution is None else solution
        return None if solution is None else solution[0][:, 0].clip(0.0) * scale

    def _bounds_of_rows(self, rows: FloatArray, columns: FloatArray, fixed: FloatArray) -> FloatArray:
        """Right-hand sides a little below 1, but for a row in which a given square is at its limit already."""
        margin = self.settings.margin
        reached = (rows * np.nan_to_num(fixed, nan=0.0)[columns]).max(axis=1)
        return np.where(reached <= 1.0 + margin, np.maximum(1.0 - margin, reached), 1.0 - margin)


def _savings(intervals: Intervals, expected: FloatArray) -> FloatArray:
    """The time that a little more of each square saves, (N + 1,)."""
    speed = np.sqrt(np.maximum(expected, 1e-12 * expected.max()))
    per_interval = intervals.lengths / (speed[:-1] + speed[1:]) ** 2
    return np.asarray((np.append(per_interval, 0.0) + np.insert(per_interval, 0, 0.0)) / speed)
