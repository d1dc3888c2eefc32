"""The inverse problem: which value of one input gives a wanted mu_macro."""

from mumacro.inverse.results import Crossing, Reach, Root, Solution, checked_case
from mumacro.inverse.solve import border_crossings, solve_for

__all__ = ["Crossing", "Reach", "Root", "Solution", "border_crossings", "checked_case", "solve_for"]
