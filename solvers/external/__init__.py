"""Solvers of other packages behind our interface: imported only when used, some need an extra to be installed."""
