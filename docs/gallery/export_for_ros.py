import tpbso_casadi as tp

plan = tp.plan("given-joints.toml")
plan.save("run", export=["ros-yaml"])  # run/joint_trajectory.yaml, a trajectory_msgs/JointTrajectory
plan.plot("limits").savefig("export-for-ros.png")
