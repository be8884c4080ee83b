"""Torque limits along a given path: what its motors have to give, and what that allows."""
