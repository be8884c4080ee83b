"""What search vectors say, or leave to the limits, of when a path is where."""
