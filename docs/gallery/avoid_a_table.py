import tpbso_casadi as tp

table = tp.Box(center=(0.6, 0.0, 0.15), size=(0.5, 1.4, 0.3))  # m
crate = tp.Box(center=(0.6, 0.0, 0.40), size=(0.3, 0.2, 0.2))
down = (1.0, 0.0, 0.0, 0.0)  # the hand's quaternion x, y, z, w
here, there = tp.Pose((0.55, 0.35, 0.40), down), tp.Pose((0.55, -0.35, 0.40), down)
plan = tp.plan("panda", start=here, goal=there, obstacles=[table, crate], margin=0.01, evaluations=5000)
print(plan)
plan.plot("path").savefig("avoid-a-table.png")
