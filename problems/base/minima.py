"""The least value of a function of one number between two others, by Brent's method."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, sqrt

GOLDEN = 0.5 * (3.0 - sqrt(5.0))
RELATIVE = sqrt(2.2e-16)  # to which a place is known where the function is flat
MOST_STEPS = 500


def bounded_minimum(
    function: Callable[[float], float], low: float, high: float, resolution: float
) -> tuple[float, float]:
    """Place and value of a function's least value between two numbers, by parabolas and golden sections [1].

    [1] R. P. Brent, "Algorithms for Minimization Without Derivatives", 1973, chapter 5.

    Args:
        function: with one minimum between them; else some local one is found.
        low: the least number.
        high: the largest.
        resolution: to which the place is found.
    """
    best = second = third = low + GOLDEN * (high - low)
    least = at_second = at_third = function(best)
    step = before = 0.0
    for _ in range(MOST_STEPS - 1):
        middle = 0.5 * (low + high)
        near = RELATIVE * abs(best) + resolution / 3.0
        if abs(best - middle) <= 2.0 * near - 0.5 * (high - low):
            break
        is_golden = True
        if abs(before) > near:
            r, q = (best - second) * (least - at_third), (best - third) * (least - at_second)
            p, q = (best - third) * q - (best - second) * r, 2.0 * (q - r)
            p, q = -p if q > 0.0 else p, abs(q)
            is_golden = not (abs(p) < abs(0.5 * q * before) and q * (low - best) < p < q * (high - best))
            before = step
            if not is_golden:
                step = p / q
                tried = best + step
                if tried - low < 2.0 * near or high - tried < 2.0 * near:
                    step = copysign(near, middle - best) if middle != best else near
        if is_golden:
            before = (low if best >= middle else high) - best
            step = GOLDEN * before
        tried = best + (copysign(max(abs(step), near), step) if step else near)
        value = function(tried)
        if value <= least:
            low, high = (best, high) if tried >= best else (low, best)
            third, at_third, second, at_second, best, least = second, at_second, best, least, tried, value
        else:
            low, high = (tried, high) if tried < best else (low, tried)
            if value <= at_second or second == best:
                third, at_third, second, at_second = second, at_second, tried, value
            elif value <= at_third or third in (best, second):
                third, at_third = tried, value
    return best, least
