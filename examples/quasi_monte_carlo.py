"""Uncertain inputs through UM-Bridge by QMCPy:  python examples/quasi_monte_carlo.py [ADDRESS]

ADDRESS is that of a running `python examples/umbridge_server.py 4242`.

All six inputs are known to a few percent, log-normally.  QMCPy's own UM-Bridge client takes the model, and its stopping
rule asks for as many points as the wanted accuracy needs: for the mean, and for the mean of the square.
"""

import math
import sys

import numpy as np
import qmcpy as qp
import umbridge

BASE = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:4242"
MEAN = np.log10([0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01])  # mu0, Fz, k, y0, omega, v0
SPREAD = np.log10([1.03, 1.02, 1.05, 1.05, 1.001, 1.02])  # one standard deviation: a factor
TOLERANCE = 2e-5

model = umbridge.HTTPModel(BASE, "mu_macro_log10")


def expectation(power: int, tolerance: float) -> tuple[float, int]:
    """The mean of (mu_macro - 0.24)^power to a tolerance, and the number of points that took."""
    measure = qp.Gaussian(qp.DigitalNetB2(6, seed=7), mean=MEAN, covariance=SPREAD**2)
    wrapped = qp.UMBridgeWrapper(measure, model, {}, parallel=False)
    shifted = qp.CustomFun(measure, lambda x, **_: (np.asarray(wrapped.g(x)).reshape(len(x)) - 0.24) ** power)
    solution, data = qp.CubQMCNetG(shifted, abs_tol=tolerance).integrate()
    return float(np.ravel(solution)[0]), int(np.ravel(data.n_total)[0])


shift, first = expectation(1, TOLERANCE)
square, second = expectation(2, 0.1 * TOLERANCE)
slopes = np.array(model.gradient(0, 0, [MEAN.tolist()], [1.0]))
first_order = math.sqrt(float(np.sum((slopes * SPREAD) ** 2)))
print(f"mean of mu_macro {0.24 + shift:.5f} +- {TOLERANCE:g}, from {first} points")
print(f"standard deviation {math.sqrt(square - shift**2):.5f}, from {second} points")
print(f"first order: standard deviation {first_order:.5f}")
