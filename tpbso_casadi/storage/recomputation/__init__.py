"""Every stored number is compared with its recomputation from the scenario and the stored motion."""
