"""Motions in the plane, as the player shows them."""
