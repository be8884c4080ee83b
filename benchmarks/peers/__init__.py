"""Against what users have today: Ruckig and TOPP-RA, under the same limits, in one run.

Each table is a module with a function that takes a ``Size`` and returns a ``Report``; ``__main__`` prints them all.
With ``--space`` one table instead: OMPL with TOPP-RA, roboplan, Drake, and ours, on problems of MotionBenchMaker.
With ``--payloads`` too: what torque limits cost, with Ruckig, TOPP-RA, OMPL with TOPP-RA, and ours.
Needs the extra ``peers``.

    python -m benchmarks.peers --workers 2
    python -m benchmarks.peers --quick
    python -m benchmarks.peers --space panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml
    python -m benchmarks.peers --space panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml --payloads 0,3
"""
