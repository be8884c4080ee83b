import tpbso_casadi as tp

arm = tp.robot("arm.urdf", max_acceleration=8.0)  # rad/s^2, which a URDF does not say
plan = tp.plan(arm, start=[-1.0, 0.3, 1.4, 0.9, 0.0], goal=tp.Pose((0.34, 0.53, 0.46)), evaluations=5000)
print(plan)
plan.plot("path").savefig("own-arm.png")
