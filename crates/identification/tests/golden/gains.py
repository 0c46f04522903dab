"""Golden values of core::identification::gains from NumPy: total least squares of a system with exact columns.

    python3 crates/identification/tests/golden/gains.py

The system is made of quotients of small integers, so that Rust makes the same bits. Exact columns are projected out by pseudo-inverse, not by
the QR decomposition of the program.
"""

import numpy as np

N = 40
row = np.arange(2 * N)


def quotient(by):
    return (row * row * 31 + row * by) % 211 / 211 - 0.5


U = np.column_stack([quotient(17), quotient(23)])
known = np.where(row % N < N // 2, 0.0, quotient(41))
arm = U @ np.array([2.0, -1.0]) + known
torque = (arm + 0.02 * quotient(97)) / np.where(row < N, 4.0, 0.25)

drives = [row < N, row >= N]
exact = np.column_stack([U, known])
sigma = np.empty(2 * N)
for of in drives:
    own = exact[of]
    left = torque[of] - own @ np.linalg.lstsq(own, torque[of], rcond=None)[0]
    sigma[of] = np.linalg.norm(left) / np.sqrt(N - own.shape[1])
T = np.column_stack([np.where(of, torque, 0.0) for of in drives]) / sigma[:, None]
exact = exact / sigma[:, None]
projected = T - exact @ (np.linalg.pinv(exact) @ T)
gains = np.linalg.svd(projected)[2][-1]
others = np.linalg.lstsq(exact, T @ gains, rcond=None)[0]
print(f"// NumPy {np.__version__}")
print([float(v) for v in np.concatenate([gains, others[:2]]) / others[2]])
