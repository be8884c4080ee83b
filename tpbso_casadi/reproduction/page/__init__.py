"""The page that a reproduction leaves: its figures, parameters and tables."""
