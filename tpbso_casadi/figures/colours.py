"""Colours of joints, of obstacles, and of what comes closest to them."""

JOINT_COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf")

OBSTACLE, COURSE = "#d62728", "#8c1c1d"  # and the way of one that moves
CLOSEST = "#c75000"


def colour_of(joint: int) -> str:
    """The colour of a joint (0-based) in every figure."""
    return JOINT_COLOURS[joint % len(JOINT_COLOURS)]
