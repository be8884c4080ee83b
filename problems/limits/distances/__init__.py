"""What has to keep a distance: obstacles from the robot, and its own bodies from each other."""
