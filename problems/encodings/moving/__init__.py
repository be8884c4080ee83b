"""Encodings of motions that leave while the robot moves."""
