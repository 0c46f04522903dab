"""Measures an identification from Python beside FIGAROH and beside NumPy with Pinocchio, on one real recording.

    PYTHON benches/python_peers.py [--rounds N] [--json]

PYTHON has didim (a release wheel), figaroh, pin and scipy. Each identifies the recorded UR10 of tests/data from the same
arrays and the same URDF: positions filtered without phase at 5 Hz and differentiated, one row in ten samples, drive
inertias, friction and offsets, weighted least squares with standard deviations. The three run alternately on one
processor in one process. Times are processor times; ratios are formed within a round. FIGAROH is used as its
documentation says, without plots and files. didim also judges its result.
"""

import argparse
import contextlib
import gzip
import io
import json
import logging
import os
import statistics
import tempfile
import time
from pathlib import Path

os.environ.update({f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")})
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import didim
import numpy as np
import pinocchio as pin
from figaroh.identification.base_identification import BaseIdentification
from figaroh.identification.config import unified_to_legacy_identif_config
from figaroh.tools.robot import Robot
from scipy import linalg, signal

UR10 = Path(__file__).resolve().parents[1] / "tests/data/ur10"
CUTOFF_HZ, FACTOR, TANH_WIDTH_RAD_S = 5.0, 10, 0.02
# Columns whose part outside of the others is smaller, of the largest, are sums of the others.
RANK_TOLERANCE = 1e-6


class Figaroh(BaseIdentification):
    """The identification of FIGAROH on arrays, with its own filters, decimation and quality report."""

    def __init__(self, robot, data):
        self._recorded = data
        super().__init__(robot, None)

    def load_param(self, config_file, setting_type="identification"):
        components = {"friction": True, "actuator_inertia": True, "joint_offset": True}
        sections = {
            "problem": {"model_components": components},
            "signal_processing": {"sampling_frequency": self._recorded.sample_rate, "cutoff_frequency": CUTOFF_HZ},
            "joints": {"active_joints": list(self.model.names)[1:]},
            "coupling": {"has_coupled_wrist": False},
        }
        self.identif_config = unified_to_legacy_identif_config(self.robot, sections)
        self.identif_config["act_idxq"] = self.identif_config["act_idxv"] = list(range(self.model.nv))

    def load_trajectory_data(self, data_source=None):
        data = self._recorded
        return {
            "timestamps": data.time,
            "positions": data.position,
            "velocities": None,
            "accelerations": None,
            "torques": data.torque,
        }


def with_figaroh(urdf, data):
    with contextlib.redirect_stdout(io.StringIO()):
        identification = Figaroh(Robot(str(urdf), package_dirs=str(urdf.parent)), data)
        identification.initialize()
        identification.solve(decimate=True, decimation_factor=FACTOR, plotting=False, wls=True)
    measured = identification.tau_noised
    return np.linalg.norm(measured - identification.tau_identif) / np.linalg.norm(measured)


def with_numpy(urdf, data):
    """IDIM-LS as one writes it by hand."""
    model = pin.buildModelFromUrdf(str(urdf))
    work, rate = model.createData(), data.sample_rate
    q = signal.sosfiltfilt(signal.butter(4, CUTOFF_HZ, fs=rate, output="sos"), data.position, axis=0)
    dq = np.gradient(q, 1.0 / rate, axis=0)
    ddq = np.gradient(dq, 1.0 / rate, axis=0)
    samples, joints = q.shape
    matrix = np.zeros((samples, joints, 14 * joints))
    for k in range(samples):
        matrix[k, :, : 10 * joints] = pin.computeJointTorqueRegressor(model, work, q[k], dq[k], ddq[k])
    for joint in range(joints):
        terms = (ddq[:, joint], dq[:, joint], np.tanh(dq[:, joint] / TANH_WIDTH_RAD_S), np.ones(samples))
        for place, term in enumerate(terms):
            matrix[:, joint, 10 * joints + 4 * joint + place] = term
    kept = signal.decimate(matrix, FACTOR, axis=0).transpose(1, 0, 2)
    torque = signal.decimate(data.torque, FACTOR, axis=0).T
    rows = torque.shape[1]
    flat, y = kept.reshape(joints * rows, -1), torque.reshape(-1)
    _, triangle, order = linalg.qr(flat, mode="economic", pivoting=True)
    rank = int(np.sum(np.abs(np.diag(triangle)) > RANK_TOLERANCE * abs(triangle[0, 0])))
    base = flat[:, np.sort(order[:rank])]
    theta = np.linalg.lstsq(base, y)[0]
    levels = np.sqrt(np.mean((y - base @ theta).reshape(joints, rows) ** 2, axis=1))
    weights = np.repeat(1.0 / levels, rows)
    weighted = base * weights[:, None]
    theta = np.linalg.lstsq(weighted, y * weights)[0]
    np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted)))
    return np.linalg.norm(y - base @ theta) / np.linalg.norm(y)


def with_didim(urdf, data):
    robot = didim.Robot.from_urdf(urdf, drive_inertia=True, friction=["viscous", "coulomb", "offset"])
    options = {"position_filter": {"cutoff_hz": CUTOFF_HZ}, "decimation_filter": {"factor": FACTOR}}
    return didim.identify(robot, didim.Recording(data.time, data.position, data.torque), **options).relative_error


def recording():
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "motion.db3"
        bag.write_bytes(gzip.decompress((UR10 / "motion.db3.gz").read_bytes()))
        return didim.read(bag, didim.Cell.read(UR10 / "cell.toml"))


class Arrays:
    """The recording as plain arrays, so that no peer waits for another's conversion."""

    def __init__(self, data):
        ((_, self.position, self.torque, *_),) = data.signals()
        self.sample_rate = data.sample_rate
        self.time = np.arange(len(self.position)) / self.sample_rate


def measure(rounds):
    logging.disable()
    data, urdf = Arrays(recording()), UR10 / "ur10.urdf"
    works = {"didim": with_didim, "FIGAROH": with_figaroh, "NumPy + Pinocchio": with_numpy}
    errors = {name: work(urdf, data) for name, work in works.items()}
    times = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            begin = time.process_time()
            work(urdf, data)
            times[name].append(1e3 * (time.process_time() - begin))
    ratios = {name: [own / of for own, of in zip(times["didim"], times[name])] for name in times}
    spread = {name: (statistics.median(of), min(of), max(of)) for name, of in ratios.items()}
    median = {name: statistics.median(of) for name, of in times.items()}
    return {"samples": len(data.time), "relative_error": errors, "processor_ms": median, "didim_of_peer": spread}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7, help="7 unless stated")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    found = measure(arguments.rounds)
    if arguments.json:
        print(json.dumps(found))
        return
    print(f"didim {didim.__version__}, {found['samples']} samples of 6 joints, {arguments.rounds} rounds, one processor\n")
    print("| work | processor time | relative error | didim's share of it |\n|---|---|---|---|")
    for name, milliseconds in found["processor_ms"].items():
        share, least, most = found["didim_of_peer"][name]
        error = 100.0 * found["relative_error"][name]
        print(f"| {name} | {milliseconds:,.0f} ms | {error:.2f} % | {share:.3f} ({least:.3f}–{most:.3f}) |")


if __name__ == "__main__":
    main()
