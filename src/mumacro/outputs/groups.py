"""Compute the dimensionless speed and amplitude."""

from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated


def groups(cases: Evaluated) -> Values:
    """Return v~ = v0/(l0 omega), y~ = y0/l0 and l0 = mu0 Fz/k, eq. (5)."""
    return {
        "groups.v_tilde": cases.v_tilde,
        "groups.y_tilde": cases.y_tilde,
        "groups.l0": cases.length_scale,
    }


GROUPS = Output(
    "groups",
    groups,
    {
        "groups.v_tilde": Member("-", "v0/(l0 omega)"),
        "groups.y_tilde": Member("-", "y0/l0; for direction normal Fz_amplitude/Fz"),
        "groups.l0": Member("m", "Length scale mu0 Fz/k; 0 for rigid contact"),
    },
    cost=2,
    parts={
        "groups": "Dimensionless groups; NaN: not finite (rigid contact, no oscillation, or beyond "
        "double range)"
    },
)
