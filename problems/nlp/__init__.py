"""The smooth nonlinear programs: variables, rows, structured starts, optimality."""
