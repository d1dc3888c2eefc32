"""Compute any periodic motion of a contact: its mean friction, the motion that gives a wanted
friction, and samples as harmonics."""
