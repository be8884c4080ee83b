"""Searches that follow gradients of a program: IPOPT from one start or from many."""
