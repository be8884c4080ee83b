"""A simulation of the planner while the arm moves and obstacles do what they want. It drives no robot."""
