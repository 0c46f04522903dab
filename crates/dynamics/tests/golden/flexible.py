"""Golden motion of a pendulum with a flexible part from SciPy.

    /tmp/venv-golden/bin/python crates/dynamics/tests/golden/flexible.py > crates/dynamics/tests/golden/flexible.toml

The equations are those of two bodies, a link that gravity and the controller pull and an inertia on a
spring and a damper, written out here and nowhere else.
"""

import numpy as np
import scipy
from scipy.integrate import solve_ivp

J, J_F, MX, FV, G = 0.5, 0.2, 0.4, 0.3, 9.81
FREQUENCY_HZ, ZETA = 7.0, 0.05
KP, KD = 300.0, 4.0
AMPLITUDE, OMEGA = 0.3, 5.0
spring = J_F * (2 * np.pi * FREQUENCY_HZ) ** 2
damper = 2 * ZETA * np.sqrt(spring * J_F)


def rate(t, y):
    q, dq, q_f, dq_f = y
    error = AMPLITUDE * np.sin(OMEGA * t) - q
    error_rate = AMPLITUDE * OMEGA * np.cos(OMEGA * t) - dq
    coupling = spring * (q_f - q) + damper * (dq_f - dq)
    torque = KP * error + KD * error_rate - FV * dq - MX * G * np.sin(q)
    return [dq, (torque + coupling) / (J - J_F), dq_f, -coupling / J_F]


times = np.linspace(0.1, 2.0, 20)
found = solve_ivp(rate, (0, 2), [0.1, 0, 0.1, 0], "DOP853", times, rtol=1e-12, atol=1e-13)
print(f"# Written by flexible.py with SciPy {scipy.__version__}.")
for name, values in [("time_s", times), ("position_rad", found.y[0]), ("velocity_rad_s", found.y[1])]:
    print(f"{name} = [" + ", ".join(repr(float(v)) for v in values) + "]")
