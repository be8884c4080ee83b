"""What a search decides about when to be where, among obstacles that move."""
