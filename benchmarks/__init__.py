"""Measurements: run as ``python -m benchmarks.NAME`` from a checkout."""
