"""What is known at a point of a program: whether it is an optimum, and what each limit and each parameter is worth."""
