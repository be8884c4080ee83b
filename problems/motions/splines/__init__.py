"""Splines over nodes of a normalised parameter, and the forms in which they are written."""
