"""The paper's claims, each with the rule by which the evidence decides it."""
