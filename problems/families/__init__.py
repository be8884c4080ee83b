"""Families of motions: each its motion, encoding, nonlinear program, structured starts and problem, in one folder."""
