"""Golden values of core::signal from SciPy and NumPy.

    python3 -m venv /tmp/venv-golden && /tmp/venv-golden/bin/pip install numpy scipy
    /tmp/venv-golden/bin/python crates/identification/tests/golden/filters.py > crates/identification/tests/golden/filters.toml

The test signal is made of quotients of small integers, so that Rust makes the same bits.
"""

import numpy as np
import scipy
from scipy import signal

N = 400
K = np.arange(N)
X = ((K * K * 7919 + 13 * K) % 1009) / 1009 + K / 64 - (K % 97) / 97
PICK = np.r_[0:5, 7:N - 5:23, N - 5:N]
RATIOS = [0.0, 0.003, 0.01, 0.02, 0.05, 0.1, 0.3, 0.6, 0.9]


def floats(values):
    return "[" + ", ".join(repr(float(v)) for v in np.ravel(values)) + "]"


def design(kind, order, ripple, cutoff):
    if kind == "butterworth":
        return signal.butter(order, cutoff, output="sos")
    return signal.cheby1(order, ripple, cutoff, output="sos")


print(f"# Written by filters.py with NumPy {np.__version__} and SciPy {scipy.__version__}.")
print(f"picked = {list(map(int, PICK))}")
print(f"ratios = {RATIOS}")
print(f"gradient = {floats(np.gradient(X, 1 / 250.0)[PICK])}")
# filtfilt on the transfer function: the recipe of the position filter.
b, a = signal.butter(4, 0.02)
print(f"filtfilt_butter4 = {floats(signal.filtfilt(b, a, X)[PICK])}")

CASES = [("butterworth", n, 0.0, c) for n in range(1, 13) for c in (0.02, 0.35)]
CASES += [("chebyshev1", n, r, c) for n in range(1, 13) for r, c in ((0.05, 0.008), (1.0, 0.4))]
for kind, order, ripple, cutoff in CASES:
    sos = design(kind, order, ripple, cutoff)
    print(f"\n[[filter]]\nkind = '{kind}'\norder = {order}\nripple_db = {ripple}\ncutoff = {cutoff}")
    h = signal.sosfreqz(sos, np.pi * np.array(RATIOS))[1]
    print(f"response_re = {floats(h.real)}\nresponse_im = {floats(h.imag)}")
    if order in (1, 4, 5, 8):
        print(f"zero_phase = {floats(signal.sosfiltfilt(sos, X)[PICK])}")
        print(f"zero_phase_padded_3 = {floats(signal.sosfiltfilt(sos, X, padlen=3)[PICK])}")
        print(f"zero_phase_padded_0 = {floats(signal.sosfiltfilt(sos, X, padlen=0)[PICK])}")
