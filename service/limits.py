"""What ``include`` adds to an answer: dimensionless groups, and the marks on the friction law.

Equation numbers are those of Benad, Nakano, Popov, Popov, "Active control of friction by transverse
oscillations" (Friction, 2018).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction import Answer, Surrogate
from friction.kernels import ROUNDING

__all__ = ["groups", "limits", "power", "stick_fraction"]

Values = Mapping[str, Any]


def groups(answer: Answer) -> dict[str, Any]:
    """v~ = v0/(l0 omega) [-], y~ = y0/l0 [-] and l0 = mu0 Fz/k [m], as the answer has them."""
    return {"v_tilde": answer.v_tilde, "y_tilde": answer.y_tilde, "l0": answer.length_scale}


def limits(surrogate: Surrogate, case: Values, answer: Answer) -> dict[str, NDArray[np.float64]]:
    """Static limit (38), border velocity, and the coefficient at the border.

    Parameters
    ----------
    surrogate : Surrogate
        Source of v~crit(y~) and of mu_macro/mu0 there.
    case : mapping
        The inputs, SI, scalars or arrays of one shape; ``k`` is None for rigid contact.
    answer : Answer
        The answer to the same case.

    Returns
    -------
    dict
        ``mu_static`` [-], ``v0_crit`` [m/s], ``mu_crit`` [-].  NaN where a number is beyond double range.

    Notes
    -----
    Without oscillation (y0 = 0 or omega = 0) both coefficients are mu0 and the border lies at v0 = 0.
    Rigid contact is the limit y~ -> inf: l0 omega v~crit = 0.477 omega sqrt(y0 l0) -> 0, with mu_crit -> 0.
    """
    mu0 = np.asarray(case["mu0"], dtype=np.float64)
    omega = np.asarray(case["omega"], dtype=np.float64)
    at_rest = (np.asarray(case["y0"]) == 0.0) | (omega == 0.0)
    if case["k"] is None:
        mu = np.where(at_rest, mu0, 0.0)
        return {"mu_static": mu, "v0_crit": np.zeros_like(mu), "mu_crit": mu.copy()}

    y_tilde = np.asarray(answer.y_tilde, dtype=np.float64)
    usable = np.isfinite(y_tilde) & ~at_rest
    y = np.where(usable, y_tilde, 1.0)[()]  # placeholders, replaced below; [()] makes a scalar of one case
    v = surrogate.v_tilde_crit(y)
    ratio = np.asarray(surrogate.mu_ratio(v, y), dtype=np.float64)
    below = np.minimum(y_tilde, 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        # (1 - y)(1 + y) keeps the digits that 1 - y^2 loses near y~ = 1.
        mu_static = mu0 * np.sqrt((1.0 - below) * (1.0 + below))
        v0_crit = np.asarray(answer.length_scale, dtype=np.float64) * v * omega
    return {
        "mu_static": np.where(at_rest, mu0, mu_static),
        "v0_crit": np.where(at_rest, 0.0, np.where(usable, v0_crit, np.nan)),
        "mu_crit": np.where(at_rest, mu0, np.where(usable, mu0 * ratio, np.nan)),
    }


def power(surrogate: Surrogate, case: Values, answer: Answer) -> dict[str, Any]:
    """What the oscillation costs and what it saves: ``oscillation`` and ``saved``, mean powers [W], with their bounds.

    Notes
    -----
    ``oscillation`` is what the shaker puts in, mu0 Fz l0 omega <y~ cos tau u_y>; what the contact turns into heat is
    this plus mu_macro Fz v0, which the drive puts in.  NaN for rigid contact, whose l0 = 0 is no unit, and where the
    groups are beyond double range.  ``saved`` is what the drive is spared, (mu0 - mu_macro) Fz v0.
    ``oscillation_bound`` and ``saved_bound`` bound their absolute errors; the first is NaN where the power is, and
    where the table has none.
    """
    mu0, load, omega, v0 = (np.asarray(case[name], dtype=np.float64) for name in ("mu0", "Fz", "omega", "v0"))
    at_rest = (np.asarray(case["y0"]) == 0.0) | (omega == 0.0)
    usable = np.isfinite(answer.v_tilde) & np.isfinite(answer.y_tilde) & ~at_rest
    v, y = (np.where(usable, group, 1.0) for group in (answer.v_tilde, answer.y_tilde))
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        unit = mu0 * load * (np.asarray(answer.length_scale) * omega)
        value, error = surrogate.power_with_bound(v, y)
        found = np.asarray(value) * unit
        bound = np.nan if error is None else np.asarray(error) * unit
        saved = (mu0 - np.asarray(answer.mu_macro)) * load * v0
        saved_bound = np.asarray(answer.error_bound) * load * v0 + ROUNDING * np.abs(saved)
    return {
        "oscillation": np.where(at_rest, 0.0, np.where(usable, found, np.nan)),
        "saved": saved,
        "oscillation_bound": np.where(at_rest, 0.0, np.where(usable, bound, np.nan)),
        "saved_bound": saved_bound,
    }


def stick_fraction(surrogate: Surrogate, case: Values, answer: Answer) -> dict[str, Any]:
    """Share of the period during which the contact sticks [-], and the bound of its error, NaN where there is none.

    Both are 0 where nothing oscillates, and for rigid contact.
    """
    v, y = np.asarray(answer.v_tilde), np.asarray(answer.y_tilde)
    value, error = surrogate.stick_fraction_with_bound(v, y)
    bound = np.asarray(np.nan if error is None else error)
    # y~ below double range: whether such a contact sticks, the groups no longer tell
    lost = (y == 0.0) & (v < np.inf) & (np.asarray(case["y0"]) > 0.0) & (np.asarray(case["omega"]) > 0.0)
    return {"stick_fraction": np.asarray(value), "stick_fraction_bound": np.where(lost, 1.0, bound)}
