"""From a scenario to a verified plan: search, refine, verify."""
