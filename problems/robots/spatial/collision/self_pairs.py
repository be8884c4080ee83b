"""placeholder until A's arrive"""

from collections.abc import Sequence

from problems.robots.spatial.spatial_arm import SpatialArm


def kept_pairs(arm: SpatialArm, disabled: Sequence[tuple[str, str]]) -> tuple[tuple[int, int], ...]:
    import casadi as ca
    import numpy as np

    from problems.base.matrix import as_array

    rng = np.random.default_rng(0)
    lo, hi = np.array(arm.position_limits).T
    P = [as_array(x) for x in arm.positions(ca.DM(rng.uniform(lo, hi, (300, arm.dof))))]
    out = []
    for a, b in arm.link_pairs:
        d = (
            np.linalg.norm(P[arm.dof + 1 + a] - P[arm.dof + 1 + b], axis=1)
            - arm.spheres[a].radius
            - arm.spheres[b].radius
        )
        if d.min() < 0 and (d < 0).mean() < 0.3 and abs(arm.spheres[a].link - arm.spheres[b].link) > 2:
            out.append((a, b))
    return tuple(out)
