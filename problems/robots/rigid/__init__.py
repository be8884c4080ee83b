"""Rigid bodies that joints connect: transforms, masses, and the torques of a motion."""
