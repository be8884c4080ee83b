"""The page that a comparison leaves: what was run, its figures and tables, in one HTML file."""
