"""Stiffness and friction from what was measured: points of mu_macro, or a loop of force."""
