"""Many runs of solvers, judged: grid, store and executors, statistics, figures and pages, of suites too."""
