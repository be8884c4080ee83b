"""Statements of tasks: start, goal, path, elbow."""
