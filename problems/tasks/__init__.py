"""What is asked for: start, goal, path, elbow."""
