"""Motions that begin while the joints move: the fastest stop, and the fastest move to a posture."""
