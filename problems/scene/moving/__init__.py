"""Obstacles that move, and how they do."""
