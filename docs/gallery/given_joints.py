import numpy as np

import tpbso_casadi as tp

home = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])  # rad
away = home + np.array([1.2, 0.3, -0.4, 0.5, 0.3, -0.2, 0.6])
plan = tp.plan("panda", start=home, goal=away, evaluations=5000)
print(plan, plan.trajectory(plan.duration))
plan.plot("joints").savefig("given-joints.png")
