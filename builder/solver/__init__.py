"""Solve the full model: slip, stick and the steady cycle."""
