"""What others plan for robots among obstacles, and we: OMPL with TOPP-RA, roboplan, Drake, and direct planning."""
