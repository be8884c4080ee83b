"""Random scenes with obstacles that move: how many are solved, how fast, and whether a certificate is ever false."""
