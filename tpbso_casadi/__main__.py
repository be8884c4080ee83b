"""``python -m tpbso_casadi``: an overview of the commands."""

from __future__ import annotations

from importlib.metadata import version

COMMANDS = """\
  python -m tpbso_casadi.solve [SCENARIO] [--solver NAME]               plan one motion
  python -m tpbso_casadi.solve [SCENARIO] --polish                      and refine it with IPOPT
  python -m tpbso_casadi.solve [SCENARIO] --animate FILE.gif            and make a film of the motion
  python -m tpbso_casadi.compare SCENARIO... --solvers bso,pso,ipopt    many runs, and their statistics
  python -m tpbso_casadi.pareto SCENARIO --objectives time,length       a front of plans: one objective for another
  python -m tpbso_casadi.reproduce --out DIR                            the paper's Section IV, reproduced
  python -m tpbso_casadi.retime PATH.csv --robot ARM.toml               the least time along a given path
  python -m tpbso_casadi.simulate SCENE.toml --every 0.1                plan again and again, in a simulation
  python -m tpbso_casadi.audit RUN_FOLDER|SCENARIO                      certificate of a run; structure of a scenario
  python -m tpbso_casadi.robots show panda|FILE.urdf                    robots in space, built in or described
  python -m tpbso_casadi.solve --list                                   the built-in scenarios
  python -m tpbso_casadi.solve --help                                   every option"""

if __name__ == "__main__":
    print(f"tpbso-casadi {version('tpbso-casadi')}: robot-arm motions by metaheuristics on one CasADi model\n")
    print(COMMANDS)
