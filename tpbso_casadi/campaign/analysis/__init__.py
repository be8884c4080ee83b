"""What the runs of a campaign show: convergence, targets reached, ranks, effect sizes."""
