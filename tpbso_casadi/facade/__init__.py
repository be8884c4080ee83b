"""What Python code calls: ``plan``, ``retime``, ``compare``, ``pareto`` and what they return."""
