import tpbso_casadi as tp

comparison = tp.compare("obstacle-3", solvers=["bso", "abso"], runs=10, evaluations=5000)
print(comparison)
comparison.plot().savefig("compare-two-solvers.png")
