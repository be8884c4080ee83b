"""The fastest motions through a few postures of a known one, which lead it past obstacles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from problems.base import FloatArray
from problems.motions import Trajectory
from problems.polish.settings import DEFAULT_PINNED, PinnedSettings
from problems.robots import JointLimits
from problems.timing import ThroughSettings, apart, fastest_through
from problems.worlds import World


def fastest_pinned(
    known: Trajectory,
    places: FloatArray,
    limits: JointLimits,
    world: World,
    rates: FloatArray | None = None,
    settings: PinnedSettings = DEFAULT_PINNED,
) -> Trajectory | None:
    """The fastest motion through postures of a known one, proven to be clear; None where none is found that is faster.

    It begins with the postures at some times. Where it touches something, it is led through the nearest posture of the
    known motion as well, first with few cells, then with many.

    Args:
        known: a motion that is clear.
        places: times at which it passes places, both ends included, (n,), s.
        limits: of the joints.
        world: the robot and its surroundings.
        rates: velocities and accelerations at both ends, (2 ends, 2, k), rad/s and rad/s^2; at rest where None.
        settings: of the search.
    """
    times, through = places[apart(known.at(places))], replace(ThroughSettings(), levels=settings.rough_levels)
    for _ in range(settings.most_pins):
        found = fastest_through(known.at(times), limits, rates, through)
        is_rough = through.levels == settings.rough_levels
        if found is None or (found.duration >= known.duration and not is_rough):
            return None
        proof = world.prove(found)
        if proof.status and not is_rough:
            return found
        if proof.status:
            through = ThroughSettings()
            continue
        pinned = _pinned(known, times, found, proof.time, settings)
        if pinned is None:
            return None
        times = pinned
    return None


def _pinned(
    known: Trajectory, times: FloatArray, found: Trajectory, touched: float, settings: PinnedSettings
) -> FloatArray | None:
    """The times with one more, nearest to where a motion touches something; None where that is one of them."""
    pieces = (found.breakpoints.size - 1) // (times.size - 1)
    passed = found.breakpoints[::pieces]
    segment = int(np.clip(np.searchsorted(passed, touched, side="right") - 1, 0, times.size - 2))
    begin, end = times[segment : segment + 2]
    if end - begin < settings.shortest * known.duration:
        return None
    between = begin + (end - begin) * np.linspace(0.0, 1.0, settings.samples + 2)[1:-1]
    away = np.abs(known.at(between) - found.at(np.array([touched]))).max(axis=1)
    return np.sort(np.append(times, between[int(np.argmin(away))]))
