"""Against what users have today: Ruckig and TOPP-RA, under the same limits, in one run.

Each table is a module with a function that takes a ``Size`` and returns a ``Report``; ``__main__`` prints them all.
Needs the extra ``peers``.

    python -m benchmarks.peers --workers 2
    python -m benchmarks.peers --quick
"""
