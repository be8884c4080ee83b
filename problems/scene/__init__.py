"""Obstacles that the robot has to keep clear of."""
