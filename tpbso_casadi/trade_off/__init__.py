"""Two objectives against each other: a front of certified plans."""
