"""Solvers for any function of a box of numbers: bounds as they come, one call, or ask and tell."""
