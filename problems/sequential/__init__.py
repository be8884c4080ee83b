"""Sequential linear programs over a path and the speed along it: what polishes a plan among obstacles."""
