"""What a motion must keep: one constraint object, from which penalty, program and audit derive."""
