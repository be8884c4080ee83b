"""Moves in free space between two states of motion: exact, and the optimum."""
