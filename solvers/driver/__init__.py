"""Everything of a search that is not its algorithm: budget, best so far, history, seed, interruption."""
