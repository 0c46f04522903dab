"""Golden values of core::regression's Ljung–Box test from statsmodels.

    /tmp/venv-golden/bin/python crates/identification/tests/golden/ljung_box.py > crates/identification/tests/golden/ljung_box.toml
"""

import numpy as np
import statsmodels
from statsmodels.stats.diagnostic import acorr_ljungbox

LAGS = 12
k = np.arange(240)
white = ((k * k * 53 + 11 * k) % 307 + (k**3 % 101)) / 307
coloured = np.convolve(white - white.mean(), [1.0, 0.6])[: k.size]

print(f"# Written by ljung_box.py with statsmodels {statsmodels.__version__}.")
print(f"lags = {LAGS}")
for name, x in [("white", white), ("coloured", coloured)]:
    x = x - x.mean()
    found = acorr_ljungbox(x, lags=[LAGS])
    print(f"\n[{name}]")
    print("residuals = [" + ", ".join(repr(float(v)) for v in x) + "]")
    print(f"statistic = {float(found['lb_stat'].iloc[0])!r}")
    print(f"probability = {float(found['lb_pvalue'].iloc[0])!r}")
