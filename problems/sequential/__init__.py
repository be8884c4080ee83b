"""Sequential linear programs over a path and the speed along it: what polishes a plan among obstacles."""

from problems.sequential.polish import Polish, can_be_polished

__all__ = ["Polish", "can_be_polished"]
