"""Arms and recordings for the tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import didim

ROOT = Path(__file__).resolve().parents[3]

#: Standard friction and drive inertia of the simulated arm's joints: N·m·s/rad, N·m, kg·m².
FV, FC, IA = np.array([6.0, 4.0]), np.array([8.0, 3.0]), np.array([1.5, 0.4])

URDF = """<robot name="two_axes">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.3 0 0.05"/><mass value="8"/>
    <inertia ixx="0.05" ixy="0.01" ixz="0" iyy="0.4" iyz="0" izz="0.4"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.2 0.02 0"/><mass value="3"/>
    <inertia ixx="0.01" ixy="0" ixz="0.002" iyy="0.08" iyz="0" izz="0.08"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <origin xyz="0 0 0.4"/><limit lower="-2" upper="2" velocity="4" effort="300"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>
    <origin xyz="0.6 0 0"/><limit lower="-2" upper="2" velocity="6" effort="120"/></joint>
</robot>"""


def random_urdf(seed: int, joints: int, *, sliding: bool = False) -> str:
    """An arm with random joints and random possible bodies; with ``sliding``, every third joint is prismatic."""
    random = np.random.default_rng(seed)

    def text(values: np.ndarray) -> str:
        return " ".join(repr(float(of)) for of in values)

    links, chain = ['<link name="link_0"/>'], []
    for joint in range(1, joints + 1):
        # A body of points: its inertia is possible.
        points = random.normal(0.0, 0.15, (20, 3))
        mass, centre = random.uniform(0.5, 8.0), points.mean(axis=0)
        off = points - centre
        moments = mass / len(points) * (np.sum(off**2) * np.eye(3) - off.T @ off)
        entries = {f"i{'xyz'[a]}{'xyz'[b]}": moments[a, b] for a in range(3) for b in range(a, 3)}
        inertia = " ".join(f'{name}="{float(of)!r}"' for name, of in entries.items())
        links.append(
            f'<link name="link_{joint}"><inertial><origin xyz="{text(centre)}"/><mass value="{mass!r}"/>'
            f"<inertia {inertia}/></inertial></link>"
        )
        kind = "prismatic" if sliding and joint % 3 == 2 else "revolute"
        chain.append(
            f'<joint name="joint_{joint}" type="{kind}"><parent link="link_{joint - 1}"/><child link="link_{joint}"/>'
            f'<origin xyz="{text(random.uniform(-0.5, 0.5, 3))}" rpy="{text(random.uniform(-1.5, 1.5, 3))}"/>'
            f'<axis xyz="{text(random.normal(0.0, 1.0, 3))}"/>'
            '<limit lower="-2" upper="2" velocity="3" effort="200"/></joint>'
        )
    return f'<robot name="random_{seed}">{"".join(links + chain)}</robot>'


@pytest.fixture(scope="session")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(URDF)
    return path


@pytest.fixture(scope="session")
def robot(urdf: Path) -> didim.Robot:
    return didim.Robot.from_urdf(urdf, drive_inertia=True, friction=["viscous", "coulomb", "offset"])


def truth(robot: didim.Robot) -> np.ndarray:
    """Standard parameters of the simulated arm: those of the file, with friction and drive inertias."""
    values = robot.nominal_parameters()
    assert values is not None
    names = robot.parameter_names
    for joint in range(2):
        for name, value in (("fv", FV), ("fc", FC), ("ia", IA)):
            key = f"{name}{joint + 1}"
            if key in names:
                values[names.index(key)] = value[joint]
    return values


def motion(seed: int, seconds: float = 20.0, rate: float = 500.0) -> tuple[np.ndarray, ...]:
    """Times, positions, speeds and accelerations on sums of sines."""
    random = np.random.default_rng(seed)
    time = np.arange(int(seconds * rate)) / rate
    signals = [np.zeros((len(time), 2)) for _ in range(3)]
    for joint in range(2):
        for harmonic in range(1, 8):
            speed = 2.0 * np.pi * harmonic * 0.15
            size, phase = random.uniform(0.05, 0.35) / harmonic**0.5, random.uniform(0.0, 2.0 * np.pi)
            signals[0][:, joint] += size * np.sin(speed * time + phase)
            signals[1][:, joint] += size * speed * np.cos(speed * time + phase)
            signals[2][:, joint] -= size * speed**2 * np.sin(speed * time + phase)
    return (time, *signals)


def recording(
    robot: didim.Robot, seed: int, values: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, positions and torques of the simulated arm, with noise."""
    time, q, dq, ddq = motion(seed)
    random = np.random.default_rng(1000 + seed)
    values = truth(robot) if values is None else values
    torque = robot.inverse_dynamics(q, dq, ddq, values) + random.normal(0.0, [1.0, 0.4], q.shape)
    return time, q + random.normal(0.0, 2e-6, q.shape), torque
