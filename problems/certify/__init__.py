"""Proofs about a finished motion, for all t."""
