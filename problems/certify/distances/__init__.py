"""How far pairs are apart over time: what proofs of clearance evaluate."""
