"""Compute any motion of a contact: a periodic one, with its mean friction, and the one that gives a
wanted friction; samples as harmonics; and steps in time."""
