"""Golden inverse dynamics and mass matrices, from Lagrange's equations.

Usage: python3 lagrange.py > lagrange.csv        (Python 3.11 with numpy, in this directory)

Independent of the library: nothing is recursive and no link has a velocity. With T_j(q) the
homogeneous transform of link j and P_j its 4 x 4 matrix of second moments (the integral of
(x y z 1)(x y z 1)' dm), Uicker's form of Lagrange's equations is

    tau_i = sum over j of  trace(dT_j/dq_i  P_j  (d2T_j/dt2)')  -  g' dT_j/dq_i ms_j

and M_ik = sum over j of trace(dT_j/dq_i P_j (dT_j/dq_k)').
"""

import tomllib

import numpy as np

LINK = ["xx", "xy", "xz", "yy", "yz", "zz", "mx", "my", "mz", "m"]


def rotation_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def rotation_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def translation(x, z):
    t = np.eye(4)
    t[0, 3], t[2, 3] = x, z
    return t


# The derivative of a joint's transform by its q is the transform times one of these.
GENERATOR = {"revolute": np.zeros((4, 4)), "prismatic": np.zeros((4, 4))}
GENERATOR["revolute"][0, 1], GENERATOR["revolute"][1, 0] = -1, 1
GENERATOR["prismatic"][2, 3] = 1


def transforms(robot, q):
    """One transform per joint, from the link before."""
    out = []
    for joint, qj in zip(robot["joint"], q):
        revolute = joint["type"] == "revolute"
        theta = np.radians(joint["theta_deg"]) + (qj if revolute else 0)
        r = joint["r_m"] + (0 if revolute else qj)
        twist = rotation_x(np.radians(joint["alpha_deg"])) @ translation(joint["d_m"], 0)
        out.append(twist @ rotation_z(theta) @ translation(0, r))
    return out


def derivative(robot, steps, link, by):
    """Derivative of T_link by every q in the list `by`, each as often as it stands there."""
    out = np.eye(4)
    for j in range(link + 1):
        out = out @ steps[j]
        for _ in range(by.count(j)):
            out = out @ GENERATOR[robot["joint"][j]["type"]]
    return out


def second_moments(values, link):
    xx, xy, xz, yy, yz, zz, mx, my, mz, m = (values[f"{name}{link + 1}"] for name in LINK)
    half = (xx + yy + zz) / 2
    return np.array(
        [
            [half - xx, -xy, -xz, mx],
            [-xy, half - yy, -yz, my],
            [-xz, -yz, half - zz, mz],
            [mx, my, mz, m],
        ]
    )


def drive_inertia(robot):
    """Joint-side inertia of the drives, with motors seen at their own joints."""
    values, r = robot["nominal"], np.array(robot["transmission"]["rows"])
    n = len(r)
    total = np.zeros((n, n))
    for m in range(n):
        s = r[m] / r[m, m]
        share = np.outer(s, s)
        for i in range(n):
            others_are_zero = np.count_nonzero(r[i]) == 1
            if i != m and others_are_zero:
                share[i, i] = 0  # part of ia_i
        total += values[f"ia{m + 1}"] * share
    return total


def friction(robot, dq):
    values, r = robot["nominal"], np.array(robot["transmission"]["rows"])
    n, width = len(r), robot["friction"]["sign"]["width_rad_s"]
    tau = np.zeros(n)
    for j in range(n):
        fv, fc, off = (values[f"{name}{j + 1}"] for name in ("fv", "fc", "off"))
        tau[j] += fv * dq[j] + fc * np.tanh(dq[j] / width) + off
        if f"fv_m{j + 1}" in values:
            s = r[j] / r[j, j]
            speed = s @ dq
            tau += values[f"fv_m{j + 1}"] * (s * speed - s**2 * dq)  # the diagonal is in fv_i
            tau += values[f"fc_m{j + 1}"] * s * np.tanh(speed / width)
    return tau


def dynamics(robot, q, dq, ddq):
    n, values = len(q), robot["nominal"]
    steps = transforms(robot, q)
    gravity = np.array([*robot["gravity_m_s2"], 0])
    mass, tau = drive_inertia(robot), friction(robot, dq)
    tau += mass @ ddq
    for link in range(n):
        p = second_moments(values, link)
        first = [derivative(robot, steps, link, [i]) for i in range(link + 1)]
        acceleration = sum(first[i] * ddq[i] for i in range(link + 1))
        for i in range(link + 1):
            for k in range(link + 1):
                acceleration = acceleration + derivative(robot, steps, link, [i, k]) * dq[i] * dq[k]
        for i in range(link + 1):
            tau[i] += np.trace(first[i] @ p @ acceleration.T) - gravity @ first[i] @ p[:, 3]
            for k in range(link + 1):
                mass[i, k] += np.trace(first[i] @ p @ first[k].T)
    return tau, mass


def main():
    generator = np.random.default_rng(40)
    print("# robot, q (n), dq (n), ddq (n), tau (n), mass matrix (n x n); made by lagrange.py")
    for path in ["../../../config/robots/tx40-physical.toml", "sliding-arm.toml"]:
        with open(path, "rb") as file:
            robot = tomllib.load(file)
        n = len(robot["joint"])
        for _ in range(8):
            q, dq, ddq = (generator.uniform(-size, size, n) for size in (3, 4, 20))
            tau, mass = dynamics(robot, q, dq, ddq)
            numbers = [*q, *dq, *ddq, *tau, *mass.flatten()]
            print(",".join([robot["name"], *(repr(float(number)) for number in numbers)]))


if __name__ == "__main__":
    main()
