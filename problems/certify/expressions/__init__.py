"""Proofs for expressions of a user's own."""
