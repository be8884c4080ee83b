"""Everything put together: a statement, a motion, an encoding, limits and an objective make a problem."""
