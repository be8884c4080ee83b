"""MotionBenchMaker: robots in clutter.

python -m benchmarks.motion_bench_maker panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml
"""
