"""Benchmark functions with known minima: the classical ones, and those of COCO's BBOB suite."""
