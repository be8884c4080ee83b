"""What is proven of a finished motion, for all t."""
