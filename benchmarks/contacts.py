"""Cost of a ball and of oscillation along and normal beside one spring; and the errors of the ball's rules.

python benchmarks/contacts.py            # nanoseconds a point, one thread, log-uniform points
python benchmarks/contacts.py --errors   # the constants of mumacro/contact.py, measured anew
"""

from __future__ import annotations

import argparse
import functools
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import quad

from mumacro import Surrogate, batch, contact
from mumacro.contact import put_rules, rules
from tests.naive import march_ball

KINDS = {"spring": None, "ball": (1, 0), "along": (0, 1), "normal": (0, 2), "ball along": (1, 1)}


def points(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Log-uniform in v~ from 1e-6 to 1e4 and y~ from 1e-4 to 1e4."""
    rng = np.random.default_rng(seed)
    return 10.0 ** rng.uniform(-6, 4, count), 10.0 ** rng.uniform(-4, 4, count)


def best(call: Callable[[], object], times: int = 7) -> float:
    """Seconds of the fastest of several calls."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        call()
        found.append(time.perf_counter() - start)
    return min(found)


def costs() -> None:
    """Mean, and median and worst of groups of 32 equal points, per kind and table."""
    v, y = points(400)
    for tolerance in (1e-4, 1e-7, 1e-10, 1e-12):
        s = Surrogate.open(tolerance, threads=1)
        put_rules(s._data, tolerance)
        spring = 0.0
        for name, kind in KINDS.items():
            amplitude = np.minimum(y, 0.99) if name == "normal" else y
            args = [(np.full(32, a), np.full(32, b)) for a, b in zip(v, amplitude, strict=True)]
            ask = functools.partial(batch.values, 0, s._data, threads=1, kind=kind)
            each = [best(functools.partial(ask, *pair), 9) / 32 for pair in args]
            mixed = best(functools.partial(ask, v, amplitude)) / v.size
            spring = spring or mixed
            told = f"mixed {1e9 * mixed:7.0f} ns, {mixed / spring:6.1f} springs; median {np.median(each) / spring:6.1f}"
            print(f"{tolerance:g} {name:10} {told}, worst {max(each) / spring:6.1f}")
    s = Surrogate.open(1e-10, threads=1)
    march: Any = march_ball
    march(1.0, 1.0, 1, 10)
    marched = best(lambda: march(0.05, 0.4, 300, 1000), 1)

    def share(xi: float) -> float:
        load = 1.0 - xi * xi
        return 1.5 * load * float(s.mu_ratio(0.05 / (1.5 * load), 0.4 / (1.5 * load)))

    adaptive = best(lambda: quad(share, 0.0, 1.0 - 1e-12, epsabs=1e-10, epsrel=1e-10, limit=200), 3)
    ball = best(lambda: s.ratio_with_bound(0.05, 0.4, contact="ball"))
    print(f"(0.05, 0.4): ball, one call {1e6 * ball:.1f} us; quad {1e3 * adaptive:.2f} ms; 300 springs {marched:.2f} s")


def errors() -> None:
    """Every rule against one of the same kind with many nodes, as the kernel uses both: the largest of mu~'s errors."""
    v, y = points(4000, 2)
    rng = np.random.default_rng(3)
    near = 1.5 * (1.0 + 10.0 ** rng.uniform(-6, 0, v.size) * rng.choice([-0.99, 1.0], v.size))
    steep = 0.33516779066085 * y * (1.0 + 10.0 ** rng.uniform(-9, -1, v.size) * rng.choice([-1.0, 1.0], v.size))
    v, y = np.concatenate([v, 10.0 ** rng.uniform(-8, 0, v.size), steep]), np.concatenate([y, near, y])
    s, tightest = Surrogate.open(1e-12), rules(1e-12)

    def with_piece(piece: int, points_of_piece: np.ndarray, stated: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s._data.put_rules([(points_of_piece, stated) if i == piece else rule for i, rule in enumerate(tightest)])
        return s.ratio_with_bound(v, y, contact="ball")[:2]

    for piece, (own, none) in enumerate(tightest):
        exact, slack = with_piece(piece, contact.points(piece, 2 * len(own)), 0.0 * none)
        for tolerance in contact._RULES:
            value, bound = with_piece(piece, *rules(tolerance)[piece])
            error, stated = np.abs(value - exact), rules(tolerance)[piece][1][0, 0]
            i = int(error.argmax())
            print(f"piece {piece}, {tolerance:g}: {error[i]:.1e} at ({v[i]:.4g}, {y[i]:.7g}), stated {stated:.1e}, "
                  f"error / bound {np.max(error / (bound + slack)):.2f}")  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--errors", action="store_true")
    errors() if parser.parse_args().errors else costs()
