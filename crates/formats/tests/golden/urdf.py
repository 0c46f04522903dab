"""Arms as URDF with their torques from Pinocchio (pip install pin).

    /tmp/venv-golden/bin/python crates/formats/tests/golden/urdf.py > crates/formats/tests/golden/urdf.toml

Links with odd frames, fixed links between, axes in any direction, joints of both kinds; one arm with a gripper that is held
still, half of them like those of catalogues, with axes that are parallel or meet. Then arms by the dimensions that their makers publish,
with bodies of chance.
"""

import numpy as np
import pinocchio as pin

random = np.random.default_rng(7)
DECIMALS = 4


def show(values):
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def text(values):
    return " ".join(repr(float(v)) for v in values)


def inertial():
    size = random.uniform(0.05, 0.3, 3)
    mass = round(random.uniform(0.5, 9), DECIMALS)
    a, b, c = mass / 12 * size**2
    return (
        f'<inertial><origin xyz="{text(random.uniform(-0.2, 0.2, 3).round(DECIMALS))}" '
        f'rpy="{text(random.uniform(-3, 3, 3).round(DECIMALS))}"/><mass value="{mass}"/>'
        f'<inertia ixx="{b + c}" ixy="0" ixz="0" iyy="{a + c}" iyz="0" izz="{a + b}"/></inertial>'
    )


def joint(name, kind, parent, child, xyz, rpy, axis):
    limit = '<limit lower="-2" upper="2" velocity="3" effort="100"/>' if kind != "fixed" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{text(xyz)}" rpy="{text(rpy)}"/><axis xyz="{text(axis)}"/>{limit}</joint>'
    )


def link(name, body=True):
    return f'<link name="{name}">{inertial() if body else ""}</link>'


def arm(name, joints, catalogue, gripper):
    parts = [link("base")]
    parent = "base"
    for k in range(joints):
        turns = random.integers(-1, 3, 3) * np.pi / 2
        xyz = random.uniform(-0.4, 0.4, 3).round(DECIMALS)
        if catalogue:
            xyz = xyz * (random.uniform(size=3) < 0.5)
            rpy, axis = turns, np.array([0.0, 0.0, 1.0])
        else:
            rpy, axis = random.uniform(-3, 3, 3).round(DECIMALS), random.uniform(-1, 1, 3).round(DECIMALS)
        kind = "prismatic" if random.uniform() < 0.25 and not catalogue else "revolute"
        parts += [joint(f"j{k}", kind, parent, f"l{k}", xyz, rpy, axis), link(f"l{k}")]
        parent = f"l{k}"
        if random.uniform() < 0.5:
            rpy = random.uniform(-3, 3, 3).round(DECIMALS)
            parts += [joint(f"f{k}", "fixed", parent, f"x{k}", xyz, rpy, [1, 0, 0]), link(f"x{k}", random.uniform() < 0.7)]
            # The chain goes on from either.
            parent = f"x{k}" if random.uniform() < 0.5 else parent
    parts += [joint("tool", "fixed", parent, "tip", [0.1, 0.2, 0.3], [0.1, 0.2, 0.3], [1, 0, 0]), link("tip", False)]
    if gripper:
        parts += [joint("finger", "prismatic", "tip", "pad", [0.0, 0.1, 0.0], [0, 0, 1.0], [0, 1, 0]), link("pad")]
    return f'<robot name="{name}">' + "".join(parts) + "</robot>"


# Modified Denavit-Hartenberg: turn about x [deg], length along x and along z [m].
KNOWN = {
    # Universal Robots, "DH parameters for calculations of kinematics and dynamics".
    "ur5e": [(0, 0, 0.1625), (90, 0, 0), (0, -0.425, 0), (0, -0.3922, 0.1333), (90, 0, 0.0997), (-90, 0, 0.0996)],
    "ur10e": [(0, 0, 0.1807), (90, 0, 0), (0, -0.6127, 0), (0, -0.57155, 0.17415), (90, 0, 0.11985), (-90, 0, 0.11655)],
    # Franka Robotics, "Robot and interface specifications".
    "panda": [(0, 0, 0.333), (-90, 0, 0), (90, 0, 0.316), (90, 0.0825, 0), (-90, -0.0825, 0.384), (90, 0, 0), (90, 0.088, 0)],
    # KUKA, data sheet of the LBR iiwa 14 R820.
    "iiwa14": [(0, 0, 0.36), (-90, 0, 0), (90, 0, 0.42), (90, 0, 0), (-90, 0, 0.4), (-90, 0, 0), (90, 0, 0.126)],
    # tests/data/README.md, and config/robots/tx40.toml with the angles at q = 0 left out.
    "kr300": [(180, 0, -0.675), (90, 0.35, -0.189), (0, 1.15, 0.189), (-90, 0.041, -1), (90, 0, 0), (-90, 0, -0.24)],
    "tx40": [(0, 0, 0.32), (-90, 0, 0), (0, 0.225, 0.035), (90, 0, 0.225), (-90, 0, 0), (90, 0, 0)],
}


def known(name):
    parts, parent = [link("base")], "base"
    for k, (turn, x, z) in enumerate(KNOWN[name]):
        alpha = np.deg2rad(turn)
        xyz = [x, -z * np.sin(alpha), z * np.cos(alpha)]
        parts += [joint(f"j{k}", "revolute", parent, f"l{k}", xyz, [alpha, 0, 0], [0, 0, 1]), link(f"l{k}")]
        parent = f"l{k}"
    parts += [joint("tool", "fixed", parent, "tip", [0, 0, 0.1], [0, 0, 0], [1, 0, 0]), link("tip", False)]
    return f'<robot name="{name}">' + "".join(parts) + "</robot>"


def states(urdf, joints):
    model = pin.buildModelFromXML(urdf)
    model.gravity.linear = np.array([0, 0, -9.81])
    data = model.createData()
    at = [model.joints[model.getJointId(f"j{k}")].idx_v for k in range(joints)]
    for _ in range(4):
        q, dq, ddq = np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
        q[at], dq[at], ddq[at] = random.uniform(-2, 2, (3, joints)) * np.array([[1], [2], [5]])
        tau = pin.rnea(model, data, q, dq, ddq)
        yield [q[at], dq[at], ddq[at], tau[at]]


def tip(urdf):
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.zeros(model.nq))
    return data.oMf[model.getFrameId("tip")].translation


def record(urdf, joints):
    print(f"\n[[arm]]\njoints = {joints}\nurdf = '''\n{urdf}'''\ntip_m = {show(tip(urdf))}")
    rows = [", ".join(show(row) for row in state) for state in states(urdf, joints)]
    print("states = [\n" + "".join(f"  [{row}],\n" for row in rows) + "]")


print(f"# Written by urdf.py with Pinocchio {pin.__version__}.")
for number in range(16):
    joints, catalogue, gripper = number % 8 + 1, number % 2 == 1, number in (5, 10)
    record(arm(f"arm{number}", joints, catalogue, gripper), joints)
for name, rows in KNOWN.items():
    record(known(name), len(rows))
