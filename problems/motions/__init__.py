"""How it moves: families of trajectories, their samples and their exact polynomial pieces."""
