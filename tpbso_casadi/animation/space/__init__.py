"""Motions in space, as the player shows them."""
