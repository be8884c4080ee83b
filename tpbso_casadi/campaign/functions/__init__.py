"""Campaigns on benchmark functions: searches of a box without a robot, in the same stores and tables."""
