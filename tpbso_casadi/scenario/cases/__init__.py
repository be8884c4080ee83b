"""Scenarios that are there: built in, generated, and the best plans known of them."""
