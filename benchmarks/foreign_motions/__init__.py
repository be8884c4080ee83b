"""What planners of today make, as their documentation shows it, proven or not for all t.

First the motions are made, with the extra ``peers``, and kept as files: as the library itself evaluates them, and as
rows each 10 ms, as users hand them to a controller, which joins them by cubics, or by quintics where they have
accelerations. Then every file is judged by ``tp.certify``, by the limits that its planner was told, and looked at by
code of its own at its own rows: what only the certificate finds broken is broken between them. Both go on where they
were stopped.

    python -m benchmarks.foreign_motions make panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml
    python -m benchmarks.foreign_motions judge panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml
"""
