"""The kinds of [task] tables."""
