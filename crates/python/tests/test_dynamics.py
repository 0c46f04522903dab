"""The dynamics of a robot on arrays: identities, and Pinocchio where it is installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import didim
from conftest import motion, truth


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


def test_names_and_files(robot: didim.Robot, urdf: Path) -> None:
    assert robot.joint_names == ["shoulder", "elbow"] and robot.joints == 2
    assert robot.name == "two_axes"
    assert "shoulder" in repr(robot)
    assert any("zz" in parameter.name for parameter in robot.base_parameters())


def test_pinocchio_computes_the_same_torques(robot: didim.Robot, urdf: Path) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    model = pinocchio.buildModelFromUrdf(str(urdf))
    data = model.createData()
    _, q, dq, ddq = motion(7, seconds=0.2)
    expected = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, dq, ddq)])
    assert np.allclose(robot.inverse_dynamics(q, dq, ddq), expected, rtol=1e-9, atol=1e-9)
