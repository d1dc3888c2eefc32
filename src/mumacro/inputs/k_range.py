"""A stiffness that is known as an interval only: its ends among the inputs.

mu~ is not monotone in k, so the extremes of mu_macro may lie inside: ``kernel/interval.c`` finds
them.
"""

ENDS = ("k_low", "k_high")  # columns that hold an interval
BOUND = "two stiffnesses [N/m] with 0 < low <= high, both finite"
