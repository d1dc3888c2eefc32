"""Define what an output is: an entry of the list in :mod:`mumacro.outputs`."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from mumacro.inputs.fields import AMPLITUDE
from mumacro.outputs.evaluated import Evaluated

Values = dict[str, Any]  # by path: one number, or an array (n,)


class Member(NamedTuple):
    """Describe one value of an output."""

    unit: str  #: in SI
    meaning: str


class Output(NamedTuple):
    """Describe one output of cases.  A new output is a file with such an entry, and a line in the
    list."""

    name: str
    #: computes all values of ``members``
    compute: Callable[[Evaluated], Values]
    #: members by path: ``power.saved`` is ``saved`` within ``power``, as JSON nests them
    members: Mapping[str, Member]
    #: time for one case, divided by the time of mu_macro of one spring across
    cost: float
    #: the same for a ball, if it differs from that of a spring
    cost_of_ball: float | None = None
    gradient: bool = False  #: whether it needs the derivatives of mu_macro
    #: a direction for which the output does not exist -> the reason
    lacks: Mapping[str, str] = {}
    #: by the name of a group of values, such as ``power_bound``: its meaning, and where it is NaN
    parts: Mapping[str, str] = {}

    def paths(self, fields: tuple[str, ...]) -> list[str]:
        """Return the paths of its values for cases with these inputs, in order."""
        absent = {"y0", AMPLITUDE} - {*fields}
        return [path for path in self.members if path.rpartition(".")[2] not in absent]
