"""How a suite comes about: what its functions are, which instances are taken, what is written of them.

Once per suite: ``python -m benchmarks.suite freeze`` writes the files that the package holds.
"""
