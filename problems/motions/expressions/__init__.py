"""Expressions of a user's own in what is known of a motion at one instant: stated, written as text, evaluated."""
