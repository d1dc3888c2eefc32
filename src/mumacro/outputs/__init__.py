"""Compute the outputs of cases.  This package has the list of outputs and the one place that
computes them.

Each output is an entry in its own file: a name, a function, its values by path with unit and
meaning, its cost, and the cases for which it does not exist, with the reason.  Python, command
line, files, HTTP and page take names, units and words from here, and write the values.  Equation
numbers are those of Benad, Nakano, Popov, Popov, "Active control of friction by transverse
oscillations" (Friction, 2018).
"""

from mumacro.outputs.deviation import STD
from mumacro.outputs.entry import Member, Output
from mumacro.outputs.gradient import GRADIENT
from mumacro.outputs.groups import GROUPS
from mumacro.outputs.limits import LIMITS
from mumacro.outputs.power import POWER
from mumacro.outputs.settling import SETTLING
from mumacro.outputs.stick_fraction import STICK_FRACTION

#: outputs by name, in the order in which an answer has them
OUTPUTS: dict[str, Output] = {
    output.name: output
    for output in (GROUPS, LIMITS, GRADIENT, STD, STICK_FRACTION, POWER, SETTLING)
}
#: every number of an answer, by its path
MEMBERS: dict[str, Member] = {
    "mu_macro": Member("-", "Macroscopic coefficient of friction"),
    "mu_ratio": Member("-", "mu_macro/mu0, from 0 to 1"),
    "error_bound": Member("-", "Bound of the absolute error of mu_macro"),
} | {path: member for output in OUTPUTS.values() for path, member in output.members.items()}
