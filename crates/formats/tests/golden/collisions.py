"""Distances between the links of collisions.urdf, by coal, at random postures.

    python3 -m venv /tmp/venv-golden && /tmp/venv-golden/bin/pip install pin
    /tmp/venv-golden/bin/python crates/formats/tests/golden/collisions.py 60 > crates/formats/tests/golden/collisions.csv

Each row has six positions [rad], the distance between the shapes as the URDF states them [m] and the distance between the capsules
about them [m], both the least over all pairs of links that no joint connects; negative where they overlap.
"""

import pathlib
import sys

import coal
import numpy as np
import pinocchio as pin

FILE = pathlib.Path(__file__).with_name("collisions.urdf")
model = pin.buildModelFromUrdf(str(FILE))
data = model.createData()
shapes = pin.buildGeomFromUrdf(model, str(FILE), pin.GeometryType.COLLISION)


def turned(to):
    """A rotation that takes z to an axis of the box."""
    if to == 2:
        return np.eye(3)
    axis = np.array([0.0, 1.0, 0.0]) if to == 0 else np.array([-1.0, 0.0, 0.0])
    return pin.AngleAxis(np.pi / 2, axis).toRotationMatrix()


def capsule(shape):
    """About a shape, and its pose in the frame of that."""
    if isinstance(shape, coal.Sphere):
        return coal.Capsule(shape.radius, 0.0), pin.SE3.Identity()
    if isinstance(shape, coal.Cylinder):
        return coal.Capsule(shape.radius, 2 * shape.halfLength), pin.SE3.Identity()
    half = np.array(shape.halfSide)
    longest = int(np.argmax(half))
    radius = np.linalg.norm(np.delete(half, longest))
    return coal.Capsule(radius, 2 * half[longest]), pin.SE3(turned(longest), np.zeros(3))


def pose(of):
    return coal.Transform3s(of.rotation, of.translation)


def distance(a, at, b, there):
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    return coal.distance(a, pose(at), b, pose(there), request, result)


objects = list(shapes.geometryObjects)
pairs = [
    (a, b)
    for a in range(len(objects))
    for b in range(len(objects))
    if objects[a].parentJoint + 2 <= objects[b].parentJoint
]
random = np.random.default_rng(1)
low, high = model.lowerPositionLimit, model.upperPositionLimit
for _ in range(int(sys.argv[1])):
    q = random.uniform(low, high)
    pin.forwardKinematics(model, data, q)
    at = [data.oMi[of.parentJoint] * of.placement for of in objects]
    true = min(distance(objects[a].geometry, at[a], objects[b].geometry, at[b]) for a, b in pairs)
    about = [capsule(of.geometry) for of in objects]
    gap = min(
        distance(about[a][0], at[a] * about[a][1], about[b][0], at[b] * about[b][1])
        for a, b in pairs
    )
    print(",".join(repr(float(v)) for v in [*q, true, gap]))
