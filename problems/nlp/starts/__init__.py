"""Where a descent begins: starts that know the structure of a task, and random ones."""
