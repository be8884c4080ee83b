"""Planning again while the arm moves: what goes on, what replaces it, and when it stops."""
