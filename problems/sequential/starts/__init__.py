"""Motions from which sequential linear programs may begin."""
