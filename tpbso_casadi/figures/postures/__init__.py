"""The figure of a path: a fan of postures, the way of the tool, and where the arm is closest to an obstacle."""
