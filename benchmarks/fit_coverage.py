"""How often the 95 % intervals of `mumacro.fit` hold the true values: 40 set-ups, 400 draws of
Gaussian noise each; and whether exact points of random contacts give the contact.

nice python benchmarks/fit_coverage.py     # minutes, on two cores; build/fit_coverage keeps results

The set-ups were written down before the fit was last changed, and are not to be chosen by their
results: spring and ball, across and along, one and two unknowns, 4 to 12 points, standard
deviations given and not given.
"""

from tests.support.measuring import main, markdown, sections  # isort: split

import hashlib
import json
import math
import warnings
from multiprocessing import Pool
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro import InputError, Surrogate, fit
from tests.support.fits import least_chi2, random_points
from tests.support.places import ROOT

Array = NDArray[np.float64]
CACHE = ROOT / "build" / "fit_coverage"
DRAWS, PROCESSES = 400, 2
_MINIMA = 5000  # random sets of points
_EXACT = 400  # fits of exact points, of each contact and direction
REGULAR = 0.95  # share of draws with one solution and closed intervals, in a set-up that has these
_CODE = b"".join(
    (ROOT / "src" / "mumacro" / "fits" / name).read_bytes() for name in ("fit.py", "profile.py")
)


class SetUp(NamedTuple):
    """A contact, how it is measured, and what is unknown of it."""

    contact: str
    direction: str
    unknowns: str  #: k, mu0 or both, with a comma
    has_std: bool  #: whether the fit is told the standard deviation
    k: float  #: N/m
    mu0: float
    Fz: float  #: N
    y0: float  #: m
    f: float  #: Hz
    v0: tuple[float, ...]  #: m/s
    spread: float  #: standard deviation of the noise of mu_macro


_SPEEDS = {
    "SLOW": (1e-4, 2e-4, 4e-4, 7e-4, 1.4e-3, 2.7e-3, 5.2e-3, 0.01),
    "STEPS": (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2),
}
# v0: from..to:points, evenly spread over the logarithm, or a list of its own
_TABLE = """
    contact direction unknowns std   k      mu0  Fz    y0      f     spread v0
    spring  across    k,mu0    given 1e6    0.30 10.0  1.0e-6  20e3  3e-3   1e-3..0.2:8
    spring  across    k,mu0    -     9e6    0.31 10.0  0.4e-6  20e3  3e-3   STEPS
    spring  across    k,mu0    given 5e5    0.20 2.0   2.0e-6  1e3   2e-3   2e-4..0.05:4
    spring  across    k,mu0    -     2e7    0.60 50.0  12e-6   200.0 5e-3   1e-4..0.05:12
    spring  across    k        given 1e5    0.15 1.0   1.5e-6  30e3  1e-3   1e-3..0.5:5
    spring  across    k        -     3e6    0.40 20.0  1.0e-6  40e3  4e-3   1e-3..0.1:10
    spring  across    k        -     1e6    0.30 10.0  6.0e-6  50.0  3e-3   2e-5..5e-3:6
    spring  across    k        given 8e6    0.25 5.0   2.0e-6  20e3  3e-3   5e-3..0.4:7
    spring  across    mu0      given 1e6    0.30 10.0  2.0e-6  20e3  5e-3   1e-3..0.3:4
    spring  across    mu0      -     4e6    0.50 8.0   3.0e-6  1e3   4e-3   2e-4..0.05:9
    ball    across    k,mu0    given 1e6    0.30 10.0  3.0e-6  20e3  3e-3   1e-3..0.5:10
    ball    across    k,mu0    -     5e6    0.20 20.0  2.4e-6  20e3  2e-3   2e-3..0.4:8
    ball    across    k,mu0    -     2e5    0.40 1.0   1.0e-6  60e3  2e-3   1e-3..0.2:12
    ball    across    k,mu0    given 1e7    0.35 30.0  6.3e-6  100.0 3e-3   4e-5..0.01:5
    ball    across    k        given 1e6    0.30 10.0  3.6e-6  20e3  3e-3   1e-4..3e-3:4
    ball    across    k        -     3e6    0.15 10.0  1.0e-6  40e3  1.5e-3 1e-3..0.25:7
    ball    across    k        -     1e5    0.50 0.5   1.5e-6  5e3   5e-3   1e-4..0.03:6
    ball    across    k        given 2e7    0.25 40.0  5.0e-6  20e3  3e-3   1e-2..0.8:9
    ball    across    mu0      given 1e6    0.30 10.0  2.0e-6  20e3  4e-3   1e-3..0.3:6
    ball    across    mu0      -     6e6    0.60 15.0  3.0e-6  300.0 6e-3   5e-5..0.02:4
    spring  along     k,mu0    -     7.52e6 0.31 10.0  0.4e-6  20e3  3e-3   SLOW
    spring  along     k,mu0    given 7.52e6 0.31 10.0  0.4e-6  20e3  5e-4   SLOW
    spring  along     k,mu0    given 1e6    0.30 10.0  2.0e-6  20e3  3e-3   1e-3..0.4:7
    spring  along     k,mu0    -     2e6    0.20 5.0   2.0e-6  1e3   3e-3   2e-4..0.012:12
    spring  along     k        given 3e6    0.40 20.0  1.6e-6  20e3  4e-3   1e-3..0.15:4
    spring  along     k        -     7.76e6 0.28 10.79 0.35e-6 26e3  3e-3   5e-5..1e-3:5
    spring  along     k        -     5e5    0.25 2.0   2.0e-6  5e3   3e-3   1e-3..0.06:8
    spring  along     k        given 1e7    0.30 10.0  2.4e-6  100.0 2e-3   3e-5..1.4e-3:6
    spring  along     mu0      given 1e6    0.30 10.0  2.0e-6  20e3  4e-3   1e-3..0.2:5
    spring  along     mu0      -     4e6    0.50 8.0   2.0e-6  1e3   5e-3   3e-4..0.015:10
    ball    along     k,mu0    given 7.52e6 0.31 10.0  0.4e-6  20e3  3e-3   SLOW
    ball    along     k,mu0    -     1e6    0.30 10.0  4.0e-6  20e3  3e-3   1e-3..0.4:9
    ball    along     k,mu0    -     3e6    0.20 10.0  2.0e-6  2e3   2e-3   5e-4..0.02:11
    ball    along     k,mu0    given 2e5    0.40 1.0   1.0e-6  40e3  3e-3   1e-3..0.2:6
    ball    along     k        given 1e7    0.28 10.79 0.35e-6 26e3  3e-3   5e-5..1e-3:5
    ball    along     k        -     2e6    0.35 10.0  1.4e-6  20e3  3e-3   1e-3..0.1:7
    ball    along     k        -     1e5    0.50 0.5   7.5e-6  500.0 4e-3   5e-4..0.02:4
    ball    along     k        given 8e6    0.20 10.0  3.0e-6  20e3  2e-3   2e-2..0.35:10
    ball    along     mu0      given 1e6    0.30 10.0  2.0e-6  20e3  4e-3   1e-3..0.2:8
    ball    along     mu0      -     5e6    0.25 10.0  1.0e-6  10e3  4e-3   1e-3..0.06:5
"""


def _read(row: str) -> SetUp:
    contact, direction, unknowns, std, *numbers, v0 = row.split()
    k, mu0, force, y0, f, spread = map(float, numbers)
    speeds = _SPEEDS.get(v0)
    if speeds is None:
        ends, count = v0.split(":")
        low, high = map(float, ends.split(".."))
        speeds = tuple(np.geomspace(low, high, int(count)).tolist())
    return SetUp(contact, direction, unknowns, std == "given", k, mu0, force, y0, f, speeds, spread)


SET_UPS = tuple(map(_read, _TABLE.strip().splitlines()[1:]))


def clean_friction(set_up: SetUp) -> Array:
    """mu_macro of the true contact, of each point."""
    mu = Surrogate.open().evaluate(
        mu0=set_up.mu0,
        Fz=set_up.Fz,
        k=set_up.k,
        y0=set_up.y0,
        f=set_up.f,
        v0=np.array(set_up.v0),
        contact=set_up.contact,
        direction=set_up.direction,
    )
    return np.asarray(mu.mu_macro)


def fitted(set_up: SetUp, mu_macro: Array) -> Any:
    """The fit of measured friction; the unknowns it was not asked for are given."""
    unknowns = set_up.unknowns.split(",")
    known: Any = {name: getattr(set_up, name) for name in ("k", "mu0") if name not in unknowns}
    columns = {"v0": np.array(set_up.v0), "mu_macro": mu_macro}
    if set_up.has_std:
        columns["std"] = np.full(mu_macro.size, set_up.spread)
    rig: Any = {"Fz": set_up.Fz, "y0": set_up.y0, "f": set_up.f}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return fit(
            columns,
            unknowns,
            contact=set_up.contact,
            direction=set_up.direction,
            **rig,
            **known,
        )


def random_contact(chance: np.random.Generator) -> tuple[dict[str, Any], Array]:
    """A contact in its rig by the names of ``evaluate``, and 3 to 8 speeds from creep to
    sliding."""
    mu0, force = chance.uniform(0.1, 0.8), 10.0 ** chance.uniform(-1.0, 2.0)
    k, f = 10.0 ** chance.uniform(4.0, 8.0), 10.0 ** chance.uniform(1.0, 5.0)
    y0 = 10.0 ** chance.uniform(-0.7, 1.0) * mu0 * force / k
    low = chance.uniform(-4.0, -1.0)
    high = chance.uniform(max(low + 0.7, -1.0), 0.5)
    v0 = 2.0 * math.pi * f * y0 * np.geomspace(10.0**low, 10.0**high, int(chance.integers(3, 9)))
    return {"mu0": mu0, "k": k, "Fz": force, "y0": y0, "f": f}, v0


def exact() -> str:
    """Fits of exact points of random contacts: how many give the contact."""
    rows, surrogate = [], Surrogate.open()
    for contact in ("spring", "ball"):
        for direction in ("across", "along"):
            chance = np.random.default_rng(48)
            words: Any = {"contact": contact, "direction": direction}
            found, off = 0, 0.0
            for _ in range(_EXACT):
                truth, v0 = random_contact(chance)
                mu = np.asarray(surrogate.evaluate(**truth, v0=v0, **words).mu_macro)
                rig = {name: truth[name] for name in ("Fz", "y0", "f")}
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    result = fit({"v0": v0, "mu_macro": mu}, **rig, **words)
                errors = [abs(x / truth[name] - 1.0) for name, x in result.values.items()]
                found += max(errors) < 1e-6
                off = max(off, *errors)
            rows.append([f"{contact}, {direction}", str(_EXACT), str(found), f"{off:.0e}"])
    return markdown(("contact", "fits", "right to 1e-6", "largest relative error"), rows)


def _tried(index: int) -> dict[str, Any]:
    """Of one set-up: shares of draws by unknown, and the processor time."""
    set_up = SET_UPS[index]
    path = CACHE / f"{_digest(set_up)}.json"
    if path.exists():
        return dict(json.loads(path.read_text("utf-8")))
    clean, unknowns = clean_friction(set_up), set_up.unknowns.split(",")
    covered = dict.fromkeys(unknowns, 0)
    regular = outside = refused = 0
    seconds = []
    for draw in range(DRAWS):
        noise = np.random.default_rng([index, draw]).normal(scale=set_up.spread, size=clean.size)
        started = process_time()
        try:
            result = fitted(set_up, clean + noise)
        except InputError:
            refused += 1
            continue
        seconds.append(process_time() - started)
        ends = result.interval
        for name in unknowns:
            covered[name] += ends[name][0] <= getattr(set_up, name) <= ends[name][1]
        outside += any(
            not ends[name][0] <= result.values[name] <= ends[name][1] for name in unknowns
        )
        closed = all(ends[name][0] > 0.0 and ends[name][1] < math.inf for name in unknowns)
        regular += closed and len(result.solutions) == 1
    answer = {
        "covered": {name: count / DRAWS for name, count in covered.items()},
        "regular": regular / DRAWS,
        "outside": outside,
        "refused": refused,
        "median_ms": 1e3 * float(np.median(seconds)),
    }
    CACHE.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(answer), "utf-8")
    return answer


def _digest(set_up: SetUp) -> str:
    """Of the set-up, the draws and the code of the fit: a result is kept until one of them
    changes."""
    return hashlib.sha256(repr((set_up, DRAWS)).encode() + _CODE).hexdigest()[:24]


def coverage() -> str:
    """A row for each set-up, and the mean of those with one solution and closed intervals."""
    with Pool(PROCESSES) as pool:
        tried = pool.map(_tried, range(len(SET_UPS)), chunksize=1)
    rows = []
    for i, (set_up, result) in enumerate(zip(SET_UPS, tried, strict=True), 1):
        covered = result["covered"]
        y_tilde = set_up.k * set_up.y0 / (set_up.mu0 * set_up.Fz)
        rows.append(
            [
                str(i),
                f"{set_up.contact}, {set_up.direction}",
                "given" if set_up.has_std else "-",
                str(len(set_up.v0)),
                f"{y_tilde:.2g}",
                f"{set_up.spread / set_up.mu0:.3f}",
                *(f"{covered[name]:.3f}" if name in covered else "-" for name in ("k", "mu0")),
                f"{result['regular']:.3f}",
                str(result["outside"]),
                str(result["refused"]),
                f"{result['median_ms']:.0f}",
            ]
        )
    header = (
        "",
        "contact",
        "std",
        "points",
        "y0/l0",
        "noise/mu0",
        "k",
        "mu0",
        "regular",
        "outside",
        "refused",
        "ms",
    )
    text = [markdown(header, rows, 3), ""]
    for name in ("k", "mu0"):
        every = [x["covered"][name] for x in tried if name in x["covered"]]
        regular = [
            x["covered"][name] for x in tried if name in x["covered"] and x["regular"] >= REGULAR
        ]
        text.append(
            f"{name}: mean {np.mean(regular):.4f} over {len(regular)} set-ups with one solution "
            f"and closed intervals in at least {100.0 * REGULAR:.0f} % of the draws; smallest of "
            f"all {len(every)}: {min(every):.3f}."
        )
    return "\n".join(text)


def minima() -> str:
    """Whether a fit has the least chi2: random points along against an independent search."""
    table, missed, refused, worst = Surrogate.open(1e-10), 0, 0, 0.0
    for seed in range(_MINIMA):
        points, rig = random_points(table, seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                found = fit(points, **rig, surrogate=table)
            except InputError:
                refused += 1
                continue
        excess = found.chi2 / least_chi2(table, points, rig) - 1.0
        worst = max(worst, excess)
        missed += excess > 1e-6
    rows = [[f"{_MINIMA:,}", f"{refused:,}", f"{missed:,}", f"{worst:.1e}"]]
    return markdown(("sets", "refused", "chi2 above the least by more than 1e-6", "most"), rows)


SECTIONS = sections(coverage, exact, minima)

if __name__ == "__main__":
    main(__doc__, SECTIONS)
