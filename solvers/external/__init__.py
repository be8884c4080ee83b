"""Solvers of other packages behind our interface: loaded only when asked for, some need an extra to be installed."""
