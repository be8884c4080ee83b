"""Scenarios: files that are validated key by key, and the built-in ones."""
