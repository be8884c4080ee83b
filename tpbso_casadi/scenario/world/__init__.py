"""The tables of a scenario file about what is there: the robot and the obstacles."""
