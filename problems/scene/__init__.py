"""What the robot has to keep clear of: obstacles, still or moving."""
