"""Uncertain inputs through UM-Bridge:  python examples/uncertainty.py [ADDRESS]

ADDRESS is that of a running `python examples/umbridge_server.py 4242`.

The amplitude, the normal force and the friction coefficient are known to a few percent.  512 Sobol
points through the model, taken by its logarithms, against the first-order estimate from one
gradient.
"""

import math
import sys

import numpy as np
import umbridge
from scipy.stats import norm, qmc

BASE = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:4242"
NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
MEAN = np.log10([0.3, 10.0, 1e6, 2e-6, 2e4 * 2 * math.pi, 0.01])
SPREAD = np.log10([1.03, 1.02, 1.0, 1.05, 1.0, 1.0])  # one standard deviation: a factor

model = umbridge.HTTPModel(BASE, "mu_macro_log10")
points = qmc.Sobol(3, rng=np.random.default_rng(1)).random(512)
samples = np.tile(MEAN, (512, 1))
samples[:, SPREAD > 0.0] += norm.ppf(points) * SPREAD[SPREAD > 0.0]
values = np.array([model([sample.tolist()])[0][0] for sample in samples])

slopes = np.array(model.gradient(0, 0, [MEAN.tolist()], [1.0]))
first_order = math.sqrt(float(np.sum((slopes * SPREAD) ** 2)))
print(f"mu_macro at the means: {model([MEAN.tolist()])[0][0]:.5f}")
print(f"512 Sobol points: mean {values.mean():.5f}, standard deviation {values.std():.5f}")
print(f"first order: standard deviation {first_order:.5f}")
for name, slope, spread in zip(NAMES, slopes, SPREAD, strict=True):
    if spread > 0.0:
        print(f"  of which {name}: {abs(slope * spread):.5f}")
