"""Golden values of core::regression from NumPy.

    /tmp/venv-golden/bin/python crates/identification/tests/golden/least_squares.py > crates/identification/tests/golden/least_squares.toml

The system is made of quotients of small integers, so that Rust makes the same bits.
"""

import numpy as np

JOINTS, N, B = 3, 40, 5
row, col = np.indices((JOINTS * N, B))
SCALE = np.array([1.0, 10.0, 0.1, 1.0, 100.0])
X = ((row * row * 31 + row * col * 17 + col * 7) % 211 / 211 - 0.5) * SCALE
k = np.arange(JOINTS * N)
NOISE = (k * k * 53 + 11 * k) % 307 / 307 - 0.5
y = X @ np.array([1.0, -0.5, 20.0, 3.0, 0.02]) + NOISE * np.array([0.01, 0.1, 1.0])[k // N]


def show(name, values):
    print(f"{name} = [" + ", ".join(repr(float(v)) for v in np.ravel(values)) + "]")


def levels(residuals):
    return np.sqrt(np.sum(residuals.reshape(JOINTS, N) ** 2, axis=1) / (N - B / JOINTS))


print(f"# Written by least_squares.py with NumPy {np.__version__}.")
show("y", y)
theta = np.linalg.lstsq(X, y, rcond=None)[0]
sigma = levels(y - X @ theta)
omega = np.repeat(sigma**2, N)
bread = np.linalg.inv(X.T @ X)
show("noise_levels", sigma)
for name, matrix, measured, covariance in [
    ("ordinary", X, y, bread @ (X.T * omega) @ X @ bread),
    ("weighted", X / np.sqrt(omega)[:, None], y / np.sqrt(omega), np.linalg.inv((X.T / omega) @ X)),
]:
    theta = np.linalg.lstsq(matrix, measured, rcond=None)[0]
    rho = y - X @ theta
    parts = rho.reshape(JOINTS, N)
    print(f"\n[{name}]")
    show("parameters", theta)
    show("covariance", covariance)
    show("singular_values", np.linalg.svd(matrix, compute_uv=False))
    print(f"condition_number = {float(np.linalg.cond(matrix))!r}")
    print(f"relative_error = {float(np.linalg.norm(rho) / np.linalg.norm(y))!r}")
    show("relative_error_per_joint", np.linalg.norm(parts, axis=1) / np.linalg.norm(y.reshape(JOINTS, N), axis=1))
    show("rms_per_joint", np.sqrt(np.mean(parts**2, axis=1)))
    show("durbin_watson_per_joint", np.sum(np.diff(parts, axis=1) ** 2, axis=1) / np.sum(parts**2, axis=1))
