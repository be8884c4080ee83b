"""Obstacles in space."""
