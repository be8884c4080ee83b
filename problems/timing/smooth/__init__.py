"""Timing under a jerk limit: time laws with continuous accelerations, and the search for the fastest one."""
