"""What moves: robots by their kinematics and their limits."""
