"""Spheres that hold a robot's bodies, and the pairs of them that have to keep apart."""
