"""The dynamics of a robot on arrays: identities, and Pinocchio where it is installed."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import didim
from conftest import motion, random_urdf, truth
from didim.cell import _rows
from didim.recording import _signal


def test_torques_are_regressor_times_parameters(robot: didim.Robot) -> None:
    _, q, dq, ddq = motion(5, seconds=0.2)
    values = truth(robot)
    regressor = robot.regressor(q, dq, ddq)
    assert regressor.shape == (len(q), 2, len(robot.parameter_names))
    torque = robot.inverse_dynamics(q, dq, ddq, values)
    assert np.allclose(regressor @ values, torque, rtol=1e-12, atol=1e-10)
    base = robot.regressor(q, dq, ddq, base=True)
    assert base.shape[2] == len(robot.base_parameters())
    assert np.allclose(base @ robot.to_base(values), torque, rtol=1e-9, atol=1e-9)
    assert np.allclose(robot.inverse_dynamics(q, dq, ddq, robot.to_base(values)), torque, rtol=1e-9, atol=1e-9)


def test_the_mass_matrix_is_that_of_the_torques(robot: didim.Robot) -> None:
    _, q, dq, ddq = motion(6, seconds=0.1)
    values = truth(robot)
    still = np.zeros_like(dq)
    weight = robot.inverse_dynamics(q, still, still, values)
    inertial = robot.inverse_dynamics(q, still, ddq, values) - weight
    masses = robot.mass_matrix(q, values)
    assert np.allclose(masses, masses.transpose(0, 2, 1))
    assert np.allclose(np.einsum("nij,nj->ni", masses, ddq), inertial, rtol=1e-9, atol=1e-9)


def test_one_row_needs_no_second_dimension_and_shapes_are_checked(robot: didim.Robot) -> None:
    torque = robot.inverse_dynamics([0.1, 0.2], [0.0, 0.0], [0.0, 0.0])
    assert torque.shape == (1, 2)
    with pytest.raises(didim.UsageError, match=r"dq has the shape \(1, 1\); give \(1, 2\)"):
        robot.inverse_dynamics([0.1, 0.2], [0.0], [0.0, 0.0])
    with pytest.raises(didim.UsageError, match="3 values"):
        robot.inverse_dynamics([0.1, 0.2], [0.0, 0.0], [0.0, 0.0], [1.0, 2.0, 3.0])
    with pytest.raises(didim.UsageError, match="standard has 1 values"):
        robot.to_base(None)  # type: ignore[arg-type]


def test_names_and_files(robot: didim.Robot, urdf: Path) -> None:
    assert robot.joint_names == ["shoulder", "elbow"] and robot.joints == 2
    assert robot.name == "two_axes"
    assert "shoulder" in repr(robot)
    assert any("zz" in parameter.name for parameter in robot.base_parameters())
    around = urdf.parent / "nowhere" / ".." / urdf.name
    (urdf.parent / "nowhere").mkdir()
    for path in (around, str(around), os.path.relpath(urdf)):
        again = didim.Robot.from_urdf(path, drive_inertia=True, friction=["viscous", "coulomb", "offset"])
        assert again.parameter_names == robot.parameter_names


@pytest.mark.parametrize("joints", range(1, 9))
@pytest.mark.parametrize("sliding", [False, True])
def test_pinocchio_computes_the_same_of_random_arms(joints: int, sliding: bool, tmp_path: Path) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    path = tmp_path / "arm.urdf"
    path.write_text(random_urdf(10 * joints + sliding, joints, sliding=sliding))
    robot = didim.Robot.from_urdf(path, drive_inertia=False, friction=[])
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    random = np.random.default_rng(joints)
    q, dq, ddq = random.uniform(-2.0, 2.0, (3, 40, joints))
    still = np.zeros_like(q)

    def same(found: np.ndarray, expected: object) -> None:
        wanted = np.array(expected)
        assert found.shape == wanted.shape
        assert np.allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())

    torque = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, dq, ddq)])
    same(robot.inverse_dynamics(q, dq, ddq), torque)
    same(robot.inverse_dynamics(q, still, still), [pinocchio.computeGeneralizedGravity(model, data, row) for row in q])
    same(robot.mass_matrix(q), [np.triu(of) + np.triu(of, 1).T for of in (pinocchio.crba(model, data, row).copy() for row in q)])

    # The frames of the links differ, and so do the parameters: the columns span the same torques.
    own = robot.regressor(q, dq, ddq, base=True).reshape(40 * joints, -1)
    rows = zip(q, dq, ddq)
    others = np.vstack([pinocchio.computeJointTorqueRegressor(model, data, *row) for row in rows])
    scale = np.linalg.norm(others)
    assert np.linalg.matrix_rank(others, tol=1e-10 * scale) == own.shape[1]
    for columns, of in ((own, others), (others, own)):
        rest = of - columns @ np.linalg.lstsq(columns, of, rcond=1e-12)[0]
        assert np.linalg.norm(rest) < 1e-9 * np.linalg.norm(of)
    values = np.concatenate([of.toDynamicParameters() for of in list(model.inertias)[1:]])
    assert np.allclose(others @ values, torque.reshape(-1), rtol=1e-9, atol=1e-9 * np.abs(torque).max())
    same((robot.regressor(q, dq, ddq) @ robot.nominal_parameters()), torque)


def test_arrays_are_borrowed_in_any_layout(robot: didim.Robot) -> None:
    _, q, dq, ddq = motion(8, seconds=40.0)
    expected = robot.inverse_dynamics(q, dq, ddq)
    assert np.shares_memory(q, _rows(q)) and np.shares_memory(q, _signal("position", q, 2))
    for of in (np.asfortranarray, lambda array: np.repeat(array, 2, axis=0)[::2], lambda array: array[:, ::-1][:, ::-1]):
        arrays = [of(array) for array in (q, dq, ddq)]
        for array in arrays:
            array.flags.writeable = False
        tracemalloc.start()
        torque = robot.inverse_dynamics(*arrays)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert np.array_equal(torque, expected)
        assert peak < 1.5 * torque.nbytes, "no copy of an argument"
