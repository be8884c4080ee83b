"""Figures of a run over time and over the search."""
