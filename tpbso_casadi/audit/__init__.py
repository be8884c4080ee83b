"""What holds, and why: of a scenario its structure, of a run its certificate."""
