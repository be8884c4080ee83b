"""How fast a motion can be: moves between postures at rest, and given paths; exact, and proven for all t."""
