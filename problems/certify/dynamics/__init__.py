"""Proofs about torques, for all t."""
