"""Audits: the structure of a scenario's constraints, the certificate and optimality of a run."""
