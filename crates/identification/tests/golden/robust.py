"""Golden values of core::regression's M-estimates from statsmodels.

    /tmp/venv-golden/bin/python crates/identification/tests/golden/robust.py > crates/identification/tests/golden/robust.toml

The scale is the median absolute residual about 0, over 0.6745; the covariance is Huber's first
(statsmodels' H1).
"""

import numpy as np
import statsmodels
import statsmodels.api as sm

N, B = 90, 4
row, col = np.indices((N, B))
X = ((row * row * 31 + row * col * 17 + col * 7) % 211 / 211 - 0.5) * np.array([1.0, 10.0, 0.1, 1.0])
k = np.arange(N)
noise = sum((k * k * p + k * q) % m / m - 0.5 for p, q, m in [(53, 11, 307), (29, 5, 283), (13, 7, 251)])
noise[[7, 31, 55]] += [4.0, -6.0, 9.0]
y = X @ np.array([1.0, -0.5, 20.0, 3.0]) + 0.3 * noise


def show(name, values):
    print(f"{name} = [" + ", ".join(repr(float(v)) for v in np.ravel(values)) + "]")


print(f"# Written by robust.py with statsmodels {statsmodels.__version__}.")
show("y", y)
for name, norm in [("huber", sm.robust.norms.HuberT(1.345)), ("bisquare", sm.robust.norms.TukeyBiweight(4.685))]:
    found = sm.RLM(y, X, M=norm).fit(maxiter=1000, tol=1e-15, cov="H1")
    print(f"\n[{name}]")
    show("parameters", found.params)
    show("covariance", found.cov_params())
    print(f"downweighted = {int(np.sum(found.weights < 0.5))}")
