"""IDIM-LS as one writes it with NumPy, SciPy and the Python package of Pinocchio: `pin`.

    PYTHON benches/numpy_idim_ls.py EXPERIMENT.csv ROBOT.toml [--samples N] [--runs N]

The same steps as `didim identify --method idim-ls`: positions filtered without phase and
differentiated, the regressor of every sample, its columns and the torques filtered without phase, one
sample in 100 kept, least squares, weighted by the noise of each joint, and the covariance. Not the
residual tests and the checks of the model, which didim does besides. The parameters are those that the
robot's file lists; reading files is not measured.

Prints one JSON object: the median time [ms], and how far the parameters are from those that the
robot's file has, in the largest of their standard deviations.
"""

import argparse
import json
import re
import statistics
import time
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy import signal

POSITION_FILTER_HZ = 200.0
FACTOR = 100
TANH_WIDTH_RAD_S = 0.05
# The order of Pinocchio.
LINK = ["m", "mx", "my", "mz", "xx", "xy", "yy", "xz", "yz", "zz"]


def model_of(robot):
    """The kinematics, as modified Denavit–Hartenberg parameters state them; regressors need no more."""
    model = pin.Model()
    model.gravity.linear = np.array(robot["gravity_m_s2"])
    parent, placement = 0, pin.SE3.Identity()
    for number, joint in enumerate(robot["joint"], start=1):
        alpha, theta = np.radians(joint["alpha_deg"]), np.radians(joint["theta_deg"])
        along_x = pin.SE3(pin.utils.rotate("x", alpha), np.array([joint["d_m"], 0.0, 0.0]))
        along_z = pin.SE3(pin.utils.rotate("z", theta), np.array([0.0, 0.0, joint["r_m"]]))
        placement = along_x * along_z
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"joint_{number}")
    return model


def identify(model, transmission, names, rate_hz, position, torque):
    """The parameters and their standard deviations, from joint-side signals, samples × joints."""
    samples, joints = position.shape
    butterworth = signal.butter(4, POSITION_FILTER_HZ, fs=rate_hz, output="sos")
    q = signal.sosfiltfilt(butterworth, position, axis=0)
    dq = np.gradient(q, 1 / rate_hz, axis=0)
    ddq = np.gradient(dq, 1 / rate_hz, axis=0)

    data = model.createData()
    links = np.empty((samples, joints, 10 * joints))
    compute = pin.computeJointTorqueRegressor
    for k in range(samples):
        links[k] = compute(model, data, q[k], dq[k], ddq[k])

    # (joint, parameter, samples) of every entry that is not always 0.
    entries = []
    for column, name in enumerate(names):
        kind, motor, joint = re.fullmatch(r"([a-z]+)(_m)?(\d)r?", name).groups()
        joint = int(joint) - 1
        turns = transmission[joint] / transmission[joint, joint]
        coupled = np.count_nonzero(turns) > 1
        if kind in LINK:
            place = 10 * joint + LINK.index(kind)
            entries += [(row, column, links[:, row, place]) for row in range(joint + 1)]
        elif kind == "fc":
            speed = dq @ turns if motor else dq[:, joint]
            rows = np.flatnonzero(turns) if motor else [joint]
            sign = np.tanh(speed / TANH_WIDTH_RAD_S)
            entries += [(row, column, turns[row] * sign) for row in rows]
        elif kind in ("fv", "ia"):
            rate = dq if kind == "fv" else ddq
            if not coupled or (kind == "fv" and not motor):
                entries.append((joint, column, rate[:, joint]))
                continue
            # What cannot be told from the joints' own terms is theirs.
            kept = np.outer(turns, turns)
            own = [i for i in range(joints) if kind == "fv" or i != joint]
            kept[own, own] = 0.0
            for row in np.flatnonzero(kept.any(axis=1)):
                entries.append((row, column, rate @ kept[row]))
        else:
            raise SystemExit(f"numpy_idim_ls.py: no column for {name}")

    chebyshev = signal.cheby1(8, 0.05, 0.8 / FACTOR, output="sos")
    stacked = np.empty((len(entries) + joints, samples))
    for to, (_, _, values) in zip(stacked, entries):
        to[:] = values
    # The command is held over the period: at an instant, the mean of the one before and after it.
    stacked[len(entries) :] = (0.5 * (torque + np.vstack([torque[:1], torque[:-1]]))).T
    kept = signal.sosfiltfilt(chebyshev, stacked, axis=1)[:, ::FACTOR]
    rows = kept.shape[1]
    matrix = np.zeros((joints, rows, len(names)))
    for (row, column, _), values in zip(entries, kept):
        matrix[row, :, column] = values
    matrix = matrix.reshape(joints * rows, len(names))
    y = kept[len(entries) :].reshape(-1)

    theta = np.linalg.lstsq(matrix, y)[0]
    freedom = rows - len(names) / joints
    levels = np.sqrt(np.sum((y - matrix @ theta).reshape(joints, rows) ** 2, axis=1) / freedom)
    weights = np.repeat(1 / levels, rows)
    weighted = matrix * weights[:, None]
    theta = np.linalg.lstsq(weighted, y * weights)[0]
    return theta, np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted)))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("experiment", type=Path)
    parser.add_argument("robot", type=Path)
    parser.add_argument("--samples", type=int, default=45_000, help="45000 unless stated")
    parser.add_argument("--runs", type=int, default=5, help="5 unless stated")
    arguments = parser.parse_args()
    robot = tomllib.loads(arguments.robot.read_text())
    transmission = np.array(robot["transmission"]["rows"])
    header = arguments.experiment.open().readline().strip().split(",")
    table = np.loadtxt(
        arguments.experiment, delimiter=",", skiprows=1, max_rows=arguments.samples
    )

    def columns(prefix):
        return table[:, [k for k, name in enumerate(header) if name.startswith(prefix)]]

    rate_hz = (len(table) - 1) / (table[-1, 0] - table[0, 0])
    position = columns("motor_position_rad_") @ np.linalg.inv(transmission).T
    torque = columns("motor_torque_nm_") @ transmission
    names = list(robot["nominal"])
    truth = np.array(list(robot["nominal"].values()))
    model, times = model_of(robot), []
    for _ in range(arguments.runs):
        begin = time.perf_counter()
        theta, deviations = identify(model, transmission, names, rate_hz, position, torque)
        times.append(1e3 * (time.perf_counter() - begin))
    result = {
        "peer": "NumPy + Pinocchio",
        "kernel": f"idim_ls_{len(table)}x{position.shape[1]}",
        "ms": statistics.median(times),
        "worst_deviation_sigma": float(np.max(np.abs(theta - truth) / deviations)),
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main()
