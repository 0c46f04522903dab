"""Exported arms in Pinocchio and MuJoCo (pip install pin mujoco), and in Octave where it is installed: the library's torques.

    mkdir /tmp/exports
    DIDIM_WRITE_EXPORTS=/tmp/exports cargo test -p didim-formats exported_files
    /tmp/venv-golden/bin/python crates/formats/tests/golden/export.py /tmp/exports
    cp /tmp/exports/{tx40,panda}.* crates/formats/tests/golden/export

Each robot's URDF and MJCF is loaded by its own reader; 10 random states; the largest difference relative to the largest torque
is at most 1e-9.
"""

import pathlib
import shutil
import subprocess
import sys

import mujoco
import numpy as np
import pinocchio as pin

LIMIT = 1e-9


def by_pinocchio(urdf, states):
    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()
    # A URDF's gravity points along -z of its root, whatever its size.
    assert np.isclose(np.linalg.norm(model.gravity.linear), 9.81)
    return [pin.rnea(model, data, q, dq, ddq) for q, dq, ddq in states]


def by_mujoco(mjcf, states):
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    data = mujoco.MjData(model)
    # MuJoCo counts friction as a constraint of the simulation; joints beyond their limits too.
    model.dof_frictionloss[:] = 0
    model.tendon_frictionloss[:] = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    torques = []
    for q, dq, ddq in states:
        data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    return torques


def by_octave(file):
    """Whether the function runs, and its masses add up to those of the URDF."""
    if shutil.which("octave-cli") is None:
        return None
    name = file.stem.replace("-", "_")
    script = f"cd('{file.parent}'); copyfile('{file.name}', '{name}.m'); arm = {name}(); printf('%.15g', sum([arm.joint.mass]))"
    if file.stem == name:
        script = f"cd('{file.parent}'); arm = {name}(); printf('%.15g', sum([arm.joint.mass]))"
    found = subprocess.run(["octave-cli", "--quiet", "--eval", script], capture_output=True, text=True, check=True)
    return float(found.stdout)


def main(folder):
    worst = 0.0
    robots = sorted(folder.glob("*.txt"))
    assert robots, "no exports there"
    for file in robots:
        rows = [np.array(line.split(), float) for line in file.read_text().splitlines()]
        states = [rows[k : k + 3] for k in range(0, len(rows), 5)]
        for name, found, expected in [
            ("pinocchio", by_pinocchio(file.with_suffix(".urdf"), states), rows[3::5]),
            ("mujoco", by_mujoco(file.with_suffix(".mjcf"), states), rows[4::5]),
        ]:
            found, expected = np.array(found), np.array(expected)
            error = np.abs(found - expected).max() / np.abs(expected).max()
            worst = max(worst, error)
            print(f"{file.stem:15} {name:10} {error:.1e}")
        mass = sum(pin.buildModelFromUrdf(str(file.with_suffix(".urdf"))).inertias[k].mass for k in range(1, len(states[0][0]) + 1))
        octave = by_octave(file.with_suffix(".m"))
        print(f"{file.stem:15} octave     " + ("is not installed" if octave is None else f"{abs(octave - mass) / mass:.1e}"))
        if octave is not None:
            worst = max(worst, abs(octave - mass) / mass)
    print(f"worst {worst:.1e}, limit {LIMIT}")
    sys.exit(worst > LIMIT)


main(pathlib.Path(sys.argv[1]))
