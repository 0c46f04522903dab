#!/usr/bin/env python3
"""Sixty situations from public reports: makes their inputs, runs the program, judges the answers.

    make.py OUT PROGRAM            make the inputs, run all commands, print the table
    make.py OUT PROGRAM ID ...     only these situations
    make.py OUT PROGRAM --loggers  from the files of ten loggers to a report
    make.py --expected             print the table of sources and expected answers, without a run

The data are simulated here: an arm, its motion, its torques and their noise, with a fixed seed.
The true parameters are known, so that values can be judged. Nothing is copied from the reports.
Only the standard library of Python is used.
"""

import json
import math
import os
import random
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SEED = 20391

# ---------------------------------------------------------------------------- vectors and the arm


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def add(*vectors):
    return tuple(sum(entries) for entries in zip(*vectors))


def scale(k, a):
    return (k * a[0], k * a[1], k * a[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def times(m, a):
    return (dot(m[0], a), dot(m[1], a), dot(m[2], a))


def transposed(m):
    return tuple(zip(*m))


def product(a, b):
    columns = transposed(b)
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def rpy_matrix(rpy):
    (cr, sr), (cp, sp), (cy, sy) = [(math.cos(v), math.sin(v)) for v in rpy]
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def axis_matrix(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    k = 1 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


class Joint:
    """A joint of the chain with the body behind it, as the URDF has them."""

    def __init__(self, name, xyz, rpy, axis, limits, mass, centre, inertia, kind="revolute"):
        norm = math.sqrt(dot(axis, axis))
        self.name, self.kind, self.xyz, self.rpy = name, kind, xyz, rpy
        self.axis = scale(1 / norm, axis)
        self.lower, self.upper, self.speed, self.effort = limits
        self.mass, self.centre = mass, centre
        xx, xy, xz, yy, yz, zz = inertia
        self.inertia = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        self.rotation = rpy_matrix(rpy)


H = math.pi / 2
RIGHT = "1.5707963267948966"


def arm():
    """The arm of most situations: six axes, as an industrial arm of 10 kg payload has them."""
    return [
        Joint("joint_1", (0, 0, 0.2), (0, 0, 0), (0, 0, 1), (-2.9, 2.9, 2.6, 320),
              5.5, (0.02, -0.03, 0.05), (0.045, 0.001, -0.002, 0.05, 0.003, 0.035)),
        Joint("joint_2", (0.05, 0, 0.15), (0, 0, 0), (0, 1, 0), (-2.1, 2.1, 2.6, 320),
              9.0, (0.015, 0.04, 0.21), (0.31, 0.002, 0.004, 0.3, -0.003, 0.05)),
        Joint("joint_3", (0, 0, 0.45), (0, 0, 0), (0, 1, 0), (-2.4, 2.4, 3, 160),
              4.5, (0.14, -0.02, 0.06), (0.03, 0.001, -0.01, 0.1, 0.002, 0.09)),
        Joint("joint_4", (0.2, 0, 0.08), (0, 0, 0), (1, 0, 0), (-3, 3, 4, 60),
              2.2, (0.12, 0.01, -0.01), (0.006, 0.0005, 0.0002, 0.02, 0.0001, 0.02)),
        Joint("joint_5", (0.22, 0, 0), (0, 0, 0), (0, 1, 0), (-2.2, 2.2, 4, 60),
              1.3, (0.03, 0.012, 0.008), (0.003, 0.0001, 0.0002, 0.004, -0.0001, 0.0035)),
        Joint("joint_6", (0.08, 0, 0), (0, 0, 0), (1, 0, 0), (-3, 3, 5, 40),
              0.7, (0.025, 0.012, -0.015), (0.0012, 0.0001, -0.0001, 0.001, 0.0001, 0.0011)),
    ]


class Drives:
    """Drive inertia and friction of every joint: the true values that the results are held to."""

    def __init__(self, ia, fv, fc, offset):
        self.ia, self.fv, self.fc, self.offset = ia, fv, fc, offset


DRIVES = Drives(
    ia=[2.1, 2.4, 1.1, 0.30, 0.26, 0.14],
    fv=[8.0, 9.0, 5.0, 1.4, 1.2, 0.7],
    fc=[9.0, 10.0, 6.0, 1.8, 1.5, 0.9],
    offset=[0.4, -0.6, 0.3, 0.1, -0.1, 0.05],
)


def number(value):
    return repr(float(value))


def numbers(values):
    return " ".join(number(v) for v in values)


def urdf(chain, name="arm6"):
    """The chain as a URDF file."""
    lines = ['<?xml version="1.0"?>', f'<robot name="{name}">', '  <link name="base_link"/>']
    parent = "base_link"
    for index, joint in enumerate(chain, 1):
        child = f"link_{index}"
        i = joint.inertia
        lines += [
            f'  <joint name="{joint.name}" type="{joint.kind}">',
            f'    <parent link="{parent}"/><child link="{child}"/>',
            f'    <origin xyz="{numbers(joint.xyz)}" rpy="{numbers(joint.rpy)}"/>',
            f'    <axis xyz="{numbers(joint.axis)}"/>',
            f'    <limit lower="{number(joint.lower)}" upper="{number(joint.upper)}"'
            f' velocity="{number(joint.speed)}" effort="{number(joint.effort)}"/>',
            "  </joint>",
            f'  <link name="{child}"><inertial><origin xyz="{numbers(joint.centre)}"/>'
            f'<mass value="{number(joint.mass)}"/>',
            f'    <inertia ixx="{number(i[0][0])}" ixy="{number(i[0][1])}" ixz="{number(i[0][2])}"'
            f' iyy="{number(i[1][1])}" iyz="{number(i[1][2])}" izz="{number(i[2][2])}"/>'
            "</inertial></link>",
        ]
        parent = child
    return "\n".join(lines + ["</robot>", ""])


def inverse_dynamics(chain, q, v, a):
    """Torques of the rigid bodies by the recursive Newton-Euler method [N·m, N]."""
    speed, turn, push = (0, 0, 0), (0, 0, 0), (0, 0, 9.81)
    bodies = []
    for joint, qi, vi, ai in zip(chain, q, v, a):
        z = joint.axis
        slides = joint.kind == "prismatic"
        rotation = joint.rotation if slides else product(joint.rotation, axis_matrix(z, qi))
        slide = times(joint.rotation, scale(qi, z)) if slides else (0, 0, 0)
        offset = add(joint.xyz, slide)
        inverse = transposed(rotation)
        swing = add(push, cross(turn, offset), cross(speed, cross(speed, offset)))
        speed, turn, push = times(inverse, speed), times(inverse, turn), times(inverse, swing)
        if slides:
            push = add(push, scale(2 * vi, cross(speed, z)), scale(ai, z))
        else:
            turn = add(turn, scale(vi, cross(speed, z)), scale(ai, z))
            speed = add(speed, scale(vi, z))
        c = joint.centre
        force = scale(joint.mass, add(push, cross(turn, c), cross(speed, cross(speed, c))))
        spin = times(joint.inertia, speed)
        moment = add(times(joint.inertia, turn), cross(speed, spin))
        bodies.append((rotation, offset, force, add(moment, cross(c, force))))
    torques, pull, bend = [0.0] * len(chain), (0, 0, 0), (0, 0, 0)
    for index in reversed(range(len(chain))):
        rotation, offset, force, moment = bodies[index]
        force, moment = add(force, pull), add(moment, bend)
        slides = chain[index].kind == "prismatic"
        torques[index] = dot(force if slides else moment, chain[index].axis)
        pull = times(rotation, force)
        bend = add(times(rotation, moment), cross(offset, pull))
    return torques


class Run:
    """A recording: times [s], positions, speeds, accelerations and torques of every sample."""

    def __init__(self, t, q, v, a, torque):
        self.t, self.q, self.v, self.a, self.torque = t, q, v, a, torque


def fourier(chain, seconds, generator):
    """Terms (amplitude, angular frequency, phase) of a motion within the limits of each joint."""
    motions = []
    for joint in chain:
        terms = [(generator.uniform(0.4, 1) / k, 2 * math.pi * k * 0.1, generator.uniform(0, 6.28))
                 for k in (1, 2, 3, 5, 8)]
        reach = sum(t[0] for t in terms)
        rate = sum(t[0] * t[1] for t in terms)
        size = min(0.42 * (joint.upper - joint.lower) / reach, 0.85 * joint.speed / rate)
        centre = (joint.upper + joint.lower) / 2
        motions.append((centre, [(size * t[0], t[1], t[2]) for t in terms]))
    return motions


def state(motion, t):
    centre, terms = motion
    q, v, a = centre, 0.0, 0.0
    for size, w, phase in terms:
        s, c = math.sin(w * t + phase), math.cos(w * t + phase)
        q, v, a = q + size * s, v + size * w * c, a - size * w * w * s
    return q, v, a


def friction(drives, index, v):
    return drives.fv[index] * v + drives.fc[index] * math.tanh(v / 0.02) + drives.offset[index]


def record(chain, drives=DRIVES, seconds=24.0, rate=250.0, seed=SEED, motions=None, noise=True):
    """A recording of the chain along a motion, with noise of positions and torques."""
    generator = random.Random(seed)
    motions = motions or fourier(chain, seconds, generator)
    run = Run([], [], [], [], [])
    for k in range(int(seconds * rate)):
        t = k / rate
        q, v, a = zip(*(state(motion, t) if not callable(motion) else motion(t)
                        for motion in motions))
        body = inverse_dynamics(chain, q, v, a)
        torque = [body[i] + drives.ia[i] * a[i] + friction(drives, i, v[i])
                  for i in range(len(chain))]
        if noise:
            torque = [x + generator.gauss(0, 0.002 * j.effort) for x, j in zip(torque, chain)]
            q = [x + generator.gauss(0, 2e-5) for x in q]
        run.t.append(t)
        run.q.append(list(q))
        run.v.append(list(v))
        run.a.append(list(a))
        run.torque.append(torque)
    return run


def table(run, header=None, separator=",", end="\n", start=0.0, digits=6):
    """A table: time, positions and torques, in SI units."""
    n = len(run.q[0])
    names = header or ["time_s"] + [f"q_{i}" for i in range(1, n + 1)] + [
        f"tau_{i}" for i in range(1, n + 1)]
    lines = [separator.join(names)]
    for t, q, torque in zip(run.t, run.q, run.torque):
        values = [f"{t + start:.6f}"] + [f"{x:.{digits}f}" for x in list(q) + list(torque)]
        lines.append(separator.join(values))
    return end.join(lines + [""])


# ---------------------------------------------------------------------------- bags and logs


def cdr_text(text, data):
    """Appends a string in the encoding of ROS 2 messages (CDR, little-endian)."""
    data += b"\0" * (-len(data) % 4)
    encoded = text.encode() + b"\0"
    return data + struct.pack("<I", len(encoded)) + encoded


def cdr_doubles(values, data):
    data += b"\0" * (-len(data) % 4)
    data += struct.pack("<I", len(values))
    if values:
        data += b"\0" * (-len(data) % 8)
    return data + struct.pack(f"<{len(values)}d", *values)


def joint_state(stamp_ns, names, positions, velocities, efforts):
    """A sensor_msgs/msg/JointState with its four bytes of encapsulation."""
    data = struct.pack("<iI", stamp_ns // 10**9, stamp_ns % 10**9)
    data = cdr_text("", data)
    data += b"\0" * (-len(data) % 4)
    data += struct.pack("<I", len(names))
    for name in names:
        data = cdr_text(name, data)
    for values in (positions, velocities, efforts):
        data = cdr_doubles(values, data)
    return b"\0\1\0\0" + data


def bag(path, messages, topic="/joint_states"):
    """A rosbag2 file (SQLite) of (stamp [ns], message)."""
    path.unlink(missing_ok=True)
    base = sqlite3.connect(path)
    base.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
    )
    base.execute(
        "INSERT INTO topics VALUES (1, ?, 'sensor_msgs/msg/JointState', 'cdr', '')", (topic,)
    )
    base.executemany(
        "INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?, ?)", messages
    )
    base.commit()
    base.close()


START_NS = 1_756_300_000_000_000_000


def states(run, chain, edit=lambda names, q, v, e: (names, q, v, e)):
    """Joint states of a recording, each changed by `edit`."""
    for t, q, v, torque in zip(run.t, run.q, run.v, run.torque):
        stamp = START_NS + round(t * 1e9)
        content = edit([j.name for j in chain], list(q), list(v), list(torque))
        yield stamp, joint_state(stamp, *content)


def zstd_stored(data):
    """The data as one frame of Zstandard, stored without compression."""
    out = struct.pack("<I", 0xFD2FB528) + bytes([0xA0]) + struct.pack("<I", len(data))
    blocks = [data[i:i + 100_000] for i in range(0, len(data), 100_000)] or [b""]
    for index, block in enumerate(blocks):
        last = index == len(blocks) - 1
        out += struct.pack("<I", len(block) << 3 | last)[:3] + block
    return out


LINE = "({}) can0 {}#{}"


def frames(log):
    """The frames (stamp, identifier, data) of a candump log."""
    for line in log.splitlines():
        stamp, _, frame = line.split()
        identifier, _, data = frame.partition("#")
        yield stamp.strip("()"), identifier, data


# ---------------------------------------------------------------------------- tries and judges


class Attempt:
    """The folder of a situation, the commands that ran in it and their answers."""

    def __init__(self, folder, program):
        self.folder, self.program = folder, program
        self.codes, self.outputs, self.errors = [], [], []

    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content)
        return path

    def run(self, *arguments, environment=None):
        done = subprocess.run(
            [self.program, *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
            capture_output=True, timeout=120, env={**os.environ, **(environment or {})},
        )
        self.codes.append(done.returncode)
        self.outputs.append(done.stdout.decode(errors="replace"))
        self.errors.append(done.stderr.decode(errors="replace"))
        return done.returncode

    def new(self, *arguments, cell="cell.toml", answers=(), inertia="true"):
        (self.folder / cell).unlink(missing_ok=True)
        answers = [f"urdf.drive_inertia={inertia}", *answers]
        options = [option for answer in answers for option in ("--set", answer)]
        return self.run("new", cell, *arguments, *options)

    def identify(self, recording, *arguments, cell="cell.toml", out="result.json"):
        (self.folder / out).unlink(missing_ok=True)
        return self.run("identify", "--cell", cell, "--input", recording, "--out", out, "--json",
                        *arguments)

    def table(self, text, answers=(), arm_file=None, inertia="true"):
        """The way of a new user: `new` with URDF and table, then `identify`."""
        self.write("arm.urdf", arm_file or urdf(arm()))
        self.write("run.csv", text)
        self.new("--robot", "arm.urdf", "--log", "run.csv", answers=answers, inertia=inertia)
        self.identify("run.csv")

    def bag(self, messages, answers=()):
        self.write("arm.urdf", urdf(arm()))
        bag(self.folder / "run.db3", messages)
        self.new("--robot", "arm.urdf", "--bag", "run.db3", answers=answers)
        self.identify("run.db3")

    @property
    def text(self):
        """Everything that the commands printed, without the long JSON objects."""
        short = [text for text in self.outputs if not text.startswith("{")]
        return "\n".join(short + self.errors)

    def result(self, out="result.json"):
        path = self.folder / out
        return json.loads(path.read_text()) if path.is_file() else None

    def refusal(self):
        """The error of the first command that failed."""
        for code, text in zip(self.codes, self.errors):
            if code:
                lines = [line for line in text.splitlines() if " WARN " not in line]
                return " ".join(" ".join(lines).split())
        return ""


def parameters(result):
    return {p["name"]: p for p in result["parameters"]}


def uses(result):
    verdict = result["verdict"]["uses"]
    good = [name for name, use in verdict.items() if use["applicable"]]
    return "usable for " + ", ".join(good) if good else "not applicable"


def findings(result, severities=("blocking", "explanatory")):
    return [f for f in result["verdict"]["findings"] if f["severity"] in severities]


def codes(result):
    return ", ".join(dict.fromkeys(f["code"] for f in findings(result)))


def short(text, size=220):
    return text if len(text) <= size else text[:size].rsplit(" ", 1)[0] + " …"


def answer(attempt, result=None):
    """The answer in one line: a result with its verdict, or the refusal."""
    result = result if result is not None else attempt.result()
    if result is None:
        return short(attempt.refusal() or "no result: " + " ".join(attempt.text.split()))
    found = codes(result)
    return f"{len(result['parameters'])} parameters, {uses(result)}" + (
        f"; findings: {found}" if found else "")


def compare(result, expected, sigmas=1.0):
    """The largest deviation from the expected parameters, in combined standard deviations."""
    mine, base = parameters(result), parameters(expected)
    if set(mine) != set(base):
        return math.inf
    return max(abs(mine[name]["value"] - base[name]["value"])
               / base[name]["combined_standard_deviation"] for name in base)


def is_same(attempt, expected, result=None):
    """The parameters of the plain recording come out, within one combined σ."""
    result = result if result is not None else attempt.result()
    if result is None:
        return False, answer(attempt)
    worst = compare(result, expected)
    return worst <= 1.0, f"{answer(attempt, result)}; at most {worst:.2g} σ off"


def true_values(drives, inertia=True):
    values = {}
    for index in range(len(drives.fv)):
        values[f"fv{index + 1}"] = drives.fv[index]
        values[f"fc{index + 1}"] = drives.fc[index]
        values[f"off{index + 1}"] = drives.offset[index]
        if inertia:
            values[f"ia{index + 1}"] = drives.ia[index]
    return values


def is_true(attempt, drives=DRIVES, inertia=True, names=None, result=None):
    """Friction, offsets and drive inertias are within three combined σ of the truth."""
    result = result if result is not None else attempt.result()
    if result is None:
        return False, answer(attempt)
    mine = parameters(result)
    deviations = {
        name: abs(mine[name]["value"] - value) / mine[name]["combined_standard_deviation"]
        for name, value in true_values(drives, inertia).items()
        if name in mine and (names is None or name in names)
    }
    name = max(deviations, key=deviations.get)
    return deviations[name] <= 3.0, (
        f"{answer(attempt, result)}; worst of {len(deviations)} true values: {name},"
        f" {deviations[name]:.2g} σ off")


def mentions(attempt, *words):
    """Every word, or one of each tuple of words, is in what the commands printed."""
    text = attempt.text.lower()
    result = attempt.result()
    if result is not None:
        text += json.dumps(result["verdict"], ensure_ascii=False).lower()
    return all(any(one.lower() in text for one in (word if isinstance(word, tuple) else (word,)))
               for word in words)


def is_refused(attempt, *words):
    """A command failed, and what was printed has the words."""
    return any(attempt.codes) and mentions(attempt, *words), answer(attempt)


def is_not_usable(attempt, *words):
    """Refused, or usable for nothing that decides, with the words in what was printed."""
    result = attempt.result()
    verdict = result["verdict"]["uses"] if result else {}
    good = [name for name in ("monitoring", "prediction", "physical-values", "rigid-body")
            if verdict.get(name, {}).get("applicable")]
    return not good and mentions(attempt, *words), answer(attempt)


def has_finding(attempt, code, number, severities=("blocking", "explanatory", "advisory")):
    """A finding of this code has this joint, motor or link among its subjects."""
    result = attempt.result()
    return result is not None and any(
        finding["code"] == code and number in sum((finding.get("subject") or {}).values(), [])
        for finding in findings(result, severities))


# ---------------------------------------------------------------------------- the situations

SITUATIONS = []


def situation(identifier, source, sentence, expected):
    """Registers a function that makes the input, runs the commands and judges the answer."""
    def register(function):
        SITUATIONS.append((identifier, source, sentence, expected, function))
        return function
    return register


def replaced(text, *pairs):
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


SAME = "the parameters of the plain recording, within 1 combined σ"

# ---- URDF files


@situation("u-zero-range", "ros/solidworks_urdf_exporter#70",
           "The CAD exporter wrote `lower`, `upper`, `effort` and `velocity` of 0 for every joint.",
           "the parameters of the plain recording; or refused with a joint, its range, and"
           " `urdf.joints`, which replaces it")
def u_zero_range(attempt, base):
    zero = '<limit lower="0" upper="0" velocity="0" effort="0"/>'
    text = re.sub(r"<limit [^>]*/>", zero, urdf(arm()))
    attempt.table(base.csv, arm_file=text)
    if attempt.result():
        return is_same(attempt, base.plain)
    return is_refused(attempt, "joint_", "urdf.joints", ("range", "limit"))


@situation("u-limit-attributes", "gbionics/idyntree#955",
           "`<limit>` has `lower` and `upper`, but neither `effort` nor `velocity`.",
           "the parameters of the plain recording, as if the two were unknown; or refused with the"
           " joint and the missing attribute")
def u_limit_attributes(attempt, base):
    text = urdf(arm())
    for joint in arm():
        text = text.replace(
            f' velocity="{number(joint.speed)}" effort="{number(joint.effort)}"', "")
    attempt.table(base.csv, arm_file=text)
    if attempt.result():
        return is_same(attempt, base.plain)
    return is_refused(attempt, "joint_1", ("effort", "velocity"))


@situation("u-axis-zero", "gbionics/idyntree#195", "The axis of joint 3 is `0 0 0`.",
           "refused with the joint and its axis")
def u_axis_zero(attempt, base):
    text = replaced(urdf(arm()), (
        '<axis xyz="0.0 1.0 0.0"/>\n    <limit lower="-2.4"',
        '<axis xyz="0.0 0.0 0.0"/>\n    <limit lower="-2.4"'))
    attempt.write("arm.urdf", text)
    attempt.run("robot", "arm.urdf")
    return is_refused(attempt, "joint_3", "axis")


@situation("u-axis-noise", "robotology/urdf2casadi-matlab#21",
           "Axes such as `1e-8 1.0 -3e-9`, as a CAD export has them.", SAME)
def u_axis_noise(attempt, base):
    text = replaced(urdf(arm()), ('<axis xyz="0.0 1.0 0.0"/>', '<axis xyz="1e-8 1.0 -3e-9"/>'))
    attempt.table(base.csv, arm_file=text)
    return is_same(attempt, base.plain)


@situation("u-crooked-axis", "petercorke/robotics-toolbox-python#441",
           "An axis that is parallel to no axis of its frame, `0.638404 0 -0.769701`.",
           "usable for prediction; friction, offsets and drive inertias within 3 combined σ of the"
           " truth")
def u_crooked_axis(attempt, base):
    chain = arm()
    axis = (0.638404, 0.0, -0.769701)
    chain[3].axis = scale(1 / math.sqrt(dot(axis, axis)), axis)
    attempt.table(table(record(chain)), arm_file=urdf(chain))
    right, text = is_true(attempt)
    return right and "prediction" in text, text


@situation("u-negative-inertia", "fiveages-sim/robot_descriptions#29",
           "A row-major inertia in the six attributes: `iyy` is negative, `izz` is 0.",
           "link_3 is named; " + SAME)
def u_negative_inertia(attempt, base):
    text = replaced(urdf(arm()), (
        'ixx="0.03" ixy="0.001" ixz="-0.01" iyy="0.1" iyz="0.002" izz="0.09"',
        'ixx="0.03" ixy="0.001" ixz="-0.01" iyy="-0.01" iyz="0.1" izz="0.0"'))
    attempt.table(base.csv, ANSWERS, text)
    attempt.run("robot", "arm.urdf")
    right, text = is_same(attempt, base.plain)
    return right and mentions(attempt, "link_3"), text


@situation("u-decimal-point", "RealManRobot/rm_models#6",
           "A missing decimal point makes `izz` a thousand times too large; the tensor is positive"
           " definite and yet no body's.", "`robot` names link_1 and its inertia")
def u_decimal_point(attempt, base):
    attempt.write("arm.urdf", replaced(urdf(arm()), ('izz="0.035"', 'izz="35.0"')))
    attempt.run("robot", "arm.urdf")
    return mentions(attempt, "link_1", "inertia"), answer_lines(attempt, "link_1")


def answer_lines(attempt, *words):
    """The printed lines that have one of the words, or the first line."""
    lines = [line.strip() for line in attempt.text.splitlines()]
    found = [line for line in lines if any(word.lower() in line.lower() for word in words)]
    return short("; ".join(found) if found else next((line for line in lines if line), "silent"))


@situation("u-wrong-mass", "JAKARobotics/jaka_ros2#15",
           "The mass of link 2 in the file is 42 kg, six times the true one.",
           SAME + "; link 2 is named as far from its nominal values")
def u_wrong_mass(attempt, base):
    attempt.table(base.csv, arm_file=replaced(urdf(arm()), ('value="9.0"', 'value="52.8"')),
                  answers=('data.torque.unit="Nm"', "data.torque.sign=1"))
    right, text = is_same(attempt, base.plain)
    return right and has_finding(attempt, "far-from-nominal", 2), text


@situation("u-xacro", "ros/urdfdom#100", "A xacro file with `${height/2}` is taken for a URDF.",
           "refused: it is xacro, with the command that converts it")
def u_xacro(attempt, base):
    text = replaced(urdf(arm()), ('name="arm6"', 'name="arm6" xmlns:xacro="http://ros.org/xacro"'),
                    ('xyz="0.0 0.0 0.2"', 'xyz="0 0 ${height/2}"'))
    attempt.write("arm.urdf.xacro", text)
    attempt.run("robot", "arm.urdf.xacro")
    return is_refused(attempt, "xacro")


MJCF = """<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="l1" pos="0 0 0.2">
<joint name="j1" type="hinge" axis="0 0 1" range="-2 2"/><geom type="capsule" size="0.05 0.2"/>
</body></worldbody><actuator><motor joint="j1"/></actuator></mujoco>
"""


@situation("u-mjcf", "ARISE-Initiative/robosuite#44",
           "The arm exists as a MuJoCo model only, and is given in place of the URDF.",
           "refused: it is MJCF, a URDF is needed")
def u_mjcf(attempt, base):
    attempt.write("arm.xml", MJCF)
    attempt.run("robot", "arm.xml")
    return is_refused(attempt, ("mjcf", "mujoco"), "urdf")


@situation("u-degrees", "ros/urdfdom#124", "`rpy` of a joint in degrees: `0 0 90`.",
           "the joint is named, with radians as the unit of `rpy`")
def u_degrees(attempt, base):
    attempt.write("arm.urdf", replaced(urdf(arm()), (
        '<origin xyz="0.2 0.0 0.08" rpy="0.0 0.0 0.0"/>',
        '<origin xyz="0.2 0.0 0.08" rpy="0 0 90"/>')))
    attempt.run("robot", "arm.urdf")
    return mentions(attempt, "joint_4", ("radian", "degree", "rad")) and "rpy" in (
        attempt.text.lower()), answer_lines(attempt, "rpy", "note")


def rail():
    """The arm on a linear axis, and the drives of its seven joints."""
    slide = Joint("rail", (0, 0, 0.1), (0, 0, 0), (0, 1, 0), (-1.5, 1.5, 1.2, 2500),
                  60.0, (0, 0, 0), (1, 0, 0, 1, 0, 1), "prismatic")
    drives = Drives([80.0] + DRIVES.ia, [300.0] + DRIVES.fv, [150.0] + DRIVES.fc,
                    [10.0] + DRIVES.offset)
    return [slide] + arm(), drives


def rail_table(run, slide):
    rows = Run(run.t, [[slide * q[0]] + [math.degrees(x) for x in q[1:]] for q in run.q],
               run.v, run.a, run.torque)
    header = ["t"] + ["E1"] + [f"A{i}" for i in range(1, 7)] + ["F_E1"] + [
        f"T_A{i}" for i in range(1, 7)]
    return table(rows, header)


RAIL_ANSWERS = (
    'data.position.columns=["E1", "A1", "A2", "A3", "A4", "A5", "A6"]',
    'data.torque.columns=["F_E1", "T_A1", "T_A2", "T_A3", "T_A4", "T_A5", "T_A6"]',
    'data.torque.unit=["N", "Nm", "Nm", "Nm", "Nm", "Nm", "Nm"]',
    "data.torque.sign=1",
    'data.side="joint"',
)
RAIL_UNITS = 'data.position.unit=[{}, "deg", "deg", "deg", "deg", "deg", "deg"]'


@situation("u-rail", "kroshu/kuka_drivers#180",
           "The arm travels on a linear axis: seven joints, the first in mm, the others in °.",
           "friction, offsets and drive inertias of all seven within 3 combined σ of the truth")
def u_rail(attempt, base):
    chain, drives = rail()
    text = rail_table(record(chain, drives), 1000.0)
    attempt.table(text, (*RAIL_ANSWERS, RAIL_UNITS.format('"mm"')), urdf(chain, "rail"))
    return is_true(attempt, drives)


@situation("u-rail-unit", "ros-industrial/kuka_experimental#100",
           "The controller reports the linear axis in mm·180/π, as if it turned.",
           "read with a unit by its size; as u-rail")
def u_rail_unit(attempt, base):
    chain, drives = rail()
    text = rail_table(record(chain, drives), 1000.0 * 180 / math.pi)
    unit = RAIL_UNITS.format('{ name = "mm*180/pi", si = 1.7453292519943295e-5 }')
    attempt.table(text, (*RAIL_ANSWERS, unit), urdf(chain, "rail"))
    return is_true(attempt, drives)


def two_arms():
    """Two arms on one base in one URDF."""
    lines = ['<?xml version="1.0"?>', '<robot name="two">', '<link name="base_link"/>']
    for side, y in (("left", "0.4"), ("right", "-0.4")):
        body = urdf(arm()).split('<link name="base_link"/>')[1].split("</robot>")[0]
        body = body.replace('"link_', f'"{side}_link_').replace('"joint_', f'"{side}_joint_')
        lines.append(body.replace('xyz="0.0 0.0 0.2"', f'xyz="0 {y} 0.2"'))
    return "\n".join(lines + ["</robot>", ""])


@situation("u-two-arms", "UniversalRobots/Universal_Robots_ROS_Driver#322",
           "One URDF and one table have two arms, with `left_` and `right_` before the names.",
           "without `--tip` both ends are named; with `--tip left_link_6` " + SAME)
def u_two_arms(attempt, base):
    run, other = base.run, base.second
    names = [f"{side}_joint_{i}" for side in ("left", "right") for i in range(1, 7)]
    both = Run(run.t, [a + b for a, b in zip(run.q, other.q)], run.v, run.a,
               [a + b for a, b in zip(run.torque, other.torque)])
    text = table(both, ["time"] + [n + "/position" for n in names] + [
        n + "/effort" for n in names])
    attempt.write("two.urdf", two_arms())
    attempt.write("run.csv", text)
    attempt.new("--robot", "two.urdf", "--log", "run.csv", cell="both.toml")
    named = mentions(attempt, "left_link_6", "right_link_6")
    first = answer(attempt)
    attempt.new("--robot", "two.urdf", "--log", "run.csv", "--tip", "left_link_6")
    attempt.identify("run.csv")
    right, text = is_same(attempt, base.plain)
    return right and named, f"{first} Then: {text}"


@situation("u-reduction", "RobotLocomotion/drake#21948",
           "Motor angles and motor torques, with gear ratios of 54.6 and 101 in `<transmission>`.",
           "1 is not taken for the ratios of these signals; with `urdf.gear_ratios` " + SAME)
def u_reduction(attempt, base):
    ratios = [101.0, 101.0, 101.0, 54.6, 54.6, 54.6]
    motors = Run(base.run.t, [[x * r for x, r in zip(q, ratios)] for q in base.run.q], [], [],
                 [[x / r for x, r in zip(e, ratios)] for e in base.run.torque])
    gears = "".join(
        f'<transmission name="t{i}"><joint name="joint_{i}"/><actuator name="m{i}">'
        f"<mechanicalReduction>{ratio}</mechanicalReduction></actuator></transmission>"
        for i, ratio in enumerate(ratios, 1))
    attempt.write("arm.urdf", replaced(urdf(arm()), ("</robot>", gears + "</robot>")))
    attempt.write("run.csv", table(motors, digits=9))
    attempt.new("--robot", "arm.urdf", "--log", "run.csv", cell="first.toml")
    open_ratios = "gear_ratios = [1.0" not in attempt.text
    attempt.new("--robot", "arm.urdf", "--log", "run.csv", answers=(
        'data.side="motor"', f"urdf.gear_ratios={ratios}", 'data.position.unit="rad"',
        'data.torque.unit="Nm"', "data.torque.sign=1"))
    attempt.identify("run.csv")
    right, text = is_same(attempt, base.plain)
    return right and open_ratios, text


# ---- tables


@situation("t-trailing", "pandas-dev/pandas#14124",
           "Every row of numbers ends with a separator, the header does not.", SAME)
def t_trailing(attempt, base):
    lines = base.csv.splitlines()
    attempt.table("\n".join([lines[0]] + [line + "," for line in lines[1:]]) + "\n")
    return is_same(attempt, base.plain)


@situation("t-utf16", "www.johndcook.com/blog/2008/08/25/powershell-output-redirection-unicode-or-"
           "ascii/", "`logger.exe > run.csv` in PowerShell wrote UTF-16.",
           "the parameters of the plain recording; or refused with UTF-16 by name")
def t_utf16(attempt, base):
    attempt.table(("\ufeff" + base.csv.replace("\n", "\r\n")).encode("utf-16-le"))
    return is_same(attempt, base.plain) if attempt.result() else is_refused(attempt, "utf-16")


@situation("t-sep", "asafdav/ng-csv#28",
           "A first line `sep=;` for Excel, semicolons and decimal commas.", SAME)
def t_sep(attempt, base):
    text = base.csv.replace(",", ";").replace(".", ",")
    attempt.table("sep=;\r\n" + text.replace("\n", "\r\n"))
    return is_same(attempt, base.plain)


@situation("t-date-time", "PlotJuggler/PlotJuggler#1259",
           "Date and time of day are two columns.",
           "both columns are taken together; or the time stays open, and with `data.rate_hz` "
           + SAME)
def t_date_time(attempt, base):
    lines = base.csv.splitlines()
    rows = [f"Date,Time,{lines[0].split(',', 1)[1]}"]
    for t, line in zip(base.run.t, lines[1:]):
        seconds = 25 + t
        rows.append(f"2026-01-01,10:{30 + int(seconds // 60)}:{seconds % 60:06.3f},"
                    + line.split(",", 1)[1])
    attempt.table("\n".join(rows) + "\n")
    if attempt.result() is None:
        attempt.new("--robot", "arm.urdf", "--log", "run.csv", answers=("data.rate_hz=250",))
        attempt.identify("run.csv")
    return is_same(attempt, base.plain)


@situation("t-microseconds", "PlotJuggler/PlotJuggler#972",
           "A column `timestamp` of 16 digits without a unit: µs since 1970.", SAME)
def t_microseconds(attempt, base):
    lines = base.csv.splitlines()
    rows = ["timestamp," + lines[0].split(",", 1)[1]] + [
        f"{1714119755252769 + round(t * 1e6)}," + line.split(",", 1)[1]
        for t, line in zip(base.run.t, lines[1:])]
    attempt.table("\n".join(rows) + "\n")
    return is_same(attempt, base.plain)


UR_NAMES = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint",
            "wrist_2_joint", "wrist_3_joint"]
ALPHABET = sorted(range(6), key=lambda i: UR_NAMES[i])


def named_arm():
    chain = arm()
    for joint, name in zip(chain, UR_NAMES):
        joint.name = name
    return urdf(chain)


@situation("t-rostopic", "jsk-ros-pkg/jsk_common#739",
           "`rostopic echo -p` of ROS 1: `%time`, `field.name0`, `field.position0`; the joints by"
           " alphabet.", SAME)
def t_rostopic(attempt, base):
    rows = ["%time,field.header.seq,field.header.stamp,field.header.frame_id," + ",".join(
        f"field.{key}{i}" for key in ("name", "position", "velocity", "effort")
        for i in range(6))]
    run = base.run
    for k, (t, q, v, e) in enumerate(zip(run.t, run.q, run.v, run.torque)):
        stamp = START_NS + round(t * 1e9)
        rows.append(f"{stamp + 150000},{k},{stamp},," + ",".join(
            [UR_NAMES[i] for i in ALPHABET]
            + [f"{values[i]:.6f}" for values in (q, v, e) for i in ALPHABET]))
    attempt.table("\n".join(rows) + "\n", arm_file=named_arm())
    return is_same(attempt, base.plain)


@situation("t-normalised", "TheRobotStudio/SO-ARM100#87",
           "A teleoperation data set: positions from −100 to 100, and no torque at all.",
           "refused: the table has no torques")
def t_normalised(attempt, base):
    rows = ["timestamp,frame_index," + ",".join(f"{n}.pos" for n in UR_NAMES)]
    for k in range(0, len(base.run.t), 8):
        rows.append(f"{base.run.t[k]:.4f},{k // 8}," + ",".join(
            f"{100 * x / 2.9:.3f}" for x in base.run.q[k]))
    attempt.table("\n".join(rows) + "\n", arm_file=named_arm())
    return is_refused(attempt, "torque")


@situation("t-clock-step", "ros-controls/ros_controllers#101",
           "The computer's clock was set back by 0.5 s during the recording.",
           "friction, offsets and drive inertias within 3 combined σ of the truth, and the step is"
           " named")
def t_clock_step(attempt, base):
    lines = base.csv.splitlines()
    rows = [lines[0]] + [
        f"{t - (0.5 if t > 12 else 0):.6f}," + line.split(",", 1)[1]
        for t, line in zip(base.run.t, lines[1:])]
    attempt.table("\n".join(rows) + "\n")
    right, text = is_true(attempt)
    return right and mentions(attempt, ("back", "begin again", "another recording", "two record",
                                        "pieces", "parts")), text


# ---- the meaning of the signals

TRUTH = "friction, offsets and drive inertias within 3 combined σ of the truth"


@situation("m-current", "UniversalRobots/Universal_Robots_ROS2_Driver#794",
           "The columns `actual_current` are currents; nothing in the file says so but the name.",
           "`new` asks for N·m per ampere and does not take them for N·m; with `per_ampere` "
           + SAME)
def m_current(attempt, base):
    constants = [12.1, 12.1, 9.0, 3.2, 3.2, 3.2]
    run = Run(base.run.t, base.run.q, [], [],
              [[x / k for x, k in zip(e, constants)] for e in base.run.torque])
    header = ["timestamp"] + [f"actual_q_{i}" for i in range(6)] + [
        f"actual_current_{i}" for i in range(6)]
    attempt.write("arm.urdf", urdf(arm()))
    attempt.write("run.csv", table(run, header, digits=8))
    attempt.new("--robot", "arm.urdf", "--log", "run.csv", cell="first.toml")
    asked = "per_ampere" in attempt.text and 'data.torque.unit = "Nm"' not in attempt.text
    first = answer_lines(attempt, "data.torque.unit", "per_ampere")
    attempt.new("--robot", "arm.urdf", "--log", "run.csv", answers=(
        'data.torque.unit="A"', f"data.torque.per_ampere={constants}", 'data.side="joint"',
        'data.position.unit="rad"', "data.torque.sign=1"))
    attempt.identify("run.csv")
    right, text = is_same(attempt, base.plain)
    return right and asked, f"{first} Then: {text}"


ANSWERS = ('data.position.unit="rad"', 'data.torque.unit="Nm"', "data.torque.sign=1",
           'data.side="joint"')


def changed(run, q=lambda k, x: x, torque=lambda k, x: x):
    """The table of a recording whose rows of positions and torques are changed."""
    return table(Run(run.t, [q(k, list(x)) for k, x in enumerate(run.q)], run.v, run.a,
                     [torque(k, list(x)) for k, x in enumerate(run.torque)]))


@situation("m-external-torque", "Kinovarobotics/Kinova-kortex2_Gen3_G3L#113",
           "The logged torques are external torques: zero but for drift and noise.",
           "refused, or usable for nothing")
def m_external(attempt, base):
    generator = random.Random(SEED)
    attempt.table(changed(base.run, torque=lambda k, e: [
        0.3 * math.sin(0.2 * k / 250 + i) + generator.gauss(0, 0.15) for i in range(6)]),
        ANSWERS)
    return is_not_usable(attempt)


@situation("m-swapped-effort", "ros-industrial/universal_robot#656",
           "Positions in the order of the chain, torques by alphabet: 1 and 3 are swapped.",
           "not usable, and the swap of 1 and 3 is named")
def m_swapped(attempt, base):
    attempt.table(changed(base.run, torque=lambda k, e: [e[2], e[1], e[0], *e[3:]]), ANSWERS)
    right, text = is_not_usable(attempt, ("swapped", "exchanged"))
    named = has_finding(attempt, "swapped-motors", 1) and has_finding(attempt, "swapped-motors", 3)
    return right and (named or attempt.result() is None and mentions(attempt, "1", "3")), text


@situation("m-coupled-axis", "ros-industrial/fanuc_experimental#17",
           "The controller shows joint 3 against the horizontal: the angle of joint 2 is in it.",
           "not usable, and a coupling of joints 2 and 3 is named with the key to set")
def m_coupled(attempt, base):
    attempt.table(changed(base.run, q=lambda k, q: [q[0], q[1], q[2] + q[1], *q[3:]]), ANSWERS)
    return is_not_usable(attempt, ("coupl", "transmission"), ("joint 3", "joints 2 and 3",
                                                             "motors 2 and 3", "joint_3"))


@situation("m-zero", "CommonplaceRobotics/iRC_ROS#98",
           "The zero of joint 5 is 7.5° off.",
           "the zero of joint 5 is named, with 7.5° within 1°")
def m_zero(attempt, base):
    off = math.radians(7.5)
    attempt.table(changed(base.run, q=lambda k, q: [*q[:4], q[4] + off, q[5]]), ANSWERS)
    result = attempt.result()
    if result is None:
        return is_refused(attempt, "joint 5", "zero")
    text = " ".join(f["message"] for f in result["verdict"]["findings"] if f["code"] == "geometry")
    sizes = [abs(float(x.replace("−", "-"))) for x in re.findall(
        r"([-−]?\d+\.?\d*)(?: ?±[^°]*)?°", text)]
    named = has_finding(attempt, "geometry", 5) and any(6.5 <= x <= 8.5 for x in sizes)
    return named, answer(attempt) + (f"; {short(text)}" if text else "")


@situation("m-full-turn", "ZeroErrControl/eRob_ROS2_MoveIt#3",
           "A drive came up one turn off: joint 4 reads 2π too much.",
           "the joint is named with the turn; or " + SAME)
def m_turn(attempt, base):
    attempt.table(changed(base.run, q=lambda k, q: [*q[:3], q[3] + 2 * math.pi, *q[4:]]), ANSWERS)
    if attempt.result():
        return is_same(attempt, base.plain)
    return is_refused(attempt, ("joint 4", "joint_4"), ("turn", "6.28", "360"))


@situation("m-per-mille", "ipa320/schunk_robots#68",
           "Torques of CiA 402 drives (6077h), in ‰ of the rated torque, another for each joint.",
           SAME)
def m_per_mille(attempt, base):
    rated = [0.3, 0.3, 0.15, 0.05, 0.05, 0.03]
    text = changed(base.run, torque=lambda k, e: [x / r for x, r in zip(e, rated)])
    units = ", ".join(f'{{ name = "per mille of {1000 * r:.0f} Nm", si = {r} }}' for r in rated)
    attempt.table(text, (f"data.torque.unit=[{units}]", 'data.position.unit="rad"',
                         "data.torque.sign=1", 'data.side="joint"'))
    return is_same(attempt, base.plain)


@situation("m-dynamixel", "ROBOTIS-GIT/dynamixel-workbench#334",
           "Positions in 4096 ticks a turn around 2048, currents in units of 2.69 mA, as integers.",
           TRUTH)
def m_dynamixel(attempt, base):
    constants = [20.0, 20.0, 15.0, 6.0, 6.0, 6.0]
    tick, step = 2 * math.pi / 4096, 2.69e-3
    rows = ["time_s," + ",".join([f"pos_{i}" for i in range(1, 7)] + [
        f"cur_{i}" for i in range(1, 7)])]
    for t, q, e in zip(base.run.t, base.run.q, base.run.torque):
        rows.append(f"{t:.6f}," + ",".join(
            [str(round(2048 + x / tick)) for x in q]
            + [str(round(x / k / step)) for x, k in zip(e, constants)]))
    units = ", ".join(f'{{ name = "2.69 mA", si = {step * k} }}' for k in constants)
    attempt.table("\n".join(rows) + "\n", (
        f'data.position.unit={{ name = "tick", si = {tick} }}', "data.position.zero=2048",
        f"data.torque.unit=[{units}]", "data.torque.sign=1", 'data.side="joint"'))
    return is_true(attempt)


@situation("m-zero-torque", "bulletphysics/bullet3#1486",
           "The simulator wrote 0 for every torque.", "refused, or usable for nothing, and the"
           " torques that do not change are named")
def m_zero_torque(attempt, base):
    attempt.table(changed(base.run, torque=lambda k, e: [0.0] * 6), ANSWERS)
    return is_not_usable(attempt, "torque", ("constant", "zero", "always 0", "0 in all", "in all"))


@situation("m-gain", "real-stanford/arx5-sdk#46",
           "The torque of joint 2 is 30 % too large: an unproven constant of the firmware.",
           "not usable for physical values, and the torque gain of joint 2 is named")
def m_gain(attempt, base):
    attempt.table(changed(base.run, torque=lambda k, e: [e[0], 1.3 * e[1], *e[2:]]), ANSWERS)
    result = attempt.result()
    if result is None:
        return is_refused(attempt, "gain", "joint 2")
    physical = result["verdict"]["uses"]["physical-values"]["applicable"]
    return has_finding(attempt, "torque-gain", 2) and not physical, answer(attempt)


@situation("m-link-sensor", "marcocognetti/FrankaEmikaPandaDynModel#6",
           "Torque sensors on the load side: a tenth of the usual friction, no drive inertia.",
           TRUTH + "; usable for prediction")
def m_sensor(attempt, base):
    drives = Drives([0.0] * 6, [0.4, 0.4, 0.3, 0.1, 0.1, 0.05],
                    [0.5, 0.6, 0.4, 0.15, 0.12, 0.08], [0.1, -0.1, 0.1, 0.02, -0.02, 0.01])
    attempt.table(table(record(arm(), drives)), inertia="false")
    right, text = is_true(attempt, drives, inertia=False)
    return right and "prediction" in text, text


@situation("m-one-joint", "kjyv/FloBaRoID#8",
           "Only joint 2 moves, the others hold their position.",
           "not usable for prediction; the joints at rest are named; friction of joint 2 within"
           " 3 combined σ of the truth")
def m_one_joint(attempt, base):
    chain = arm()
    motions = fourier(chain, 24.0, random.Random(SEED))
    still = [m if i == 1 else (0.3, []) for i, m in enumerate(motions)]
    attempt.table(table(record(chain, motions=still)), ANSWERS)
    result = attempt.result()
    if result is None:
        return False, answer(attempt)
    right, text = is_true(attempt, names=["fv2", "fc2"])
    rest = all(has_finding(attempt, "joint-at-rest", i) for i in (1, 3, 4, 5, 6))
    return right and rest and not result["verdict"]["uses"]["prediction"]["applicable"], text


@situation("m-sines", "HighTorque-Robotics/Panthera-HT_SDK#2",
           "All joints follow one sine of the same frequency and phase.",
           "not usable for prediction, and a richer motion is asked for")
def m_sines(attempt, base):
    chain = arm()
    sine = [(0.1, [(0.5, 2 * math.pi * 0.25, 0.0)]) for _ in chain]
    attempt.table(table(record(chain, motions=sine)), ANSWERS)
    result = attempt.result()
    if result is None:
        return is_refused(attempt, "motion")
    prediction = result["verdict"]["uses"]["prediction"]["applicable"]
    return not prediction and mentions(attempt, ("record more", "richer", "move", "motion")), (
        answer(attempt))


def sweeps(index, count):
    """Speeds back and forth of one joint, one after the other, the others at rest."""
    speeds = (0.2, 0.4, 0.8, 1.2)

    def motion(t):
        place = t - 8.0 * index
        if not 0 <= place < 8.0:
            return 0.0, 0.0, 0.0
        number_of_pair, within = divmod(place, 2.0)
        speed = speeds[int(number_of_pair)]
        way = 2 * math.pi / 2.0
        shape = math.sin(way * within)
        flat = math.tanh(6 * shape)
        slope = 6 * (1 - flat * flat) * way * math.cos(way * within)
        return speed * integral(within), speed * flat, speed * slope

    def integral(within):
        return sum(math.tanh(6 * math.sin(math.pi * (k + 0.5) * within / 200)) * within / 200
                   for k in range(200))

    return motion


@situation("m-friction-test", "enactic/openarm#103",
           "A friction test: one joint after the other at constant speeds in both directions.",
           "viscous and Coulomb friction of all joints within 3 combined σ of the truth")
def m_friction_test(attempt, base):
    chain = arm()
    run = record(chain, seconds=48.0, rate=100.0, motions=[sweeps(i, 6) for i in range(6)])
    attempt.table(table(run), ANSWERS)
    return is_true(attempt, names=[f"{n}{i}" for n in ("fv", "fc") for i in range(1, 7)])


def loaded(mass, centre, second=None):
    """A recording with a load in the frame of link_6, along the second motion."""
    chain = arm()
    last = chain[5]
    total = last.mass + mass
    middle = scale(1 / total, add(scale(last.mass, last.centre), scale(mass, centre)))
    tensor = [list(row) for row in last.inertia]
    for part, place in ((last.mass, last.centre), (mass, centre)):
        d = add(place, scale(-1, middle))
        for i in range(3):
            for j in range(3):
                tensor[i][j] += part * ((dot(d, d) if i == j else 0) - d[i] * d[j])
    last.mass, last.centre, last.inertia = total, middle, tuple(map(tuple, tensor))
    return record(chain, motions=fourier(chain, 24.0, random.Random(77)), seed=78)


def load_run(attempt, base, mass, centre, *options):
    attempt.table(base.csv)
    attempt.write("load.csv", table(loaded(mass, centre)))
    attempt.run("payload", "--cell", "cell.toml", "--result", "result.json", "--input", "load.csv",
                "--json", *options)
    return json.loads(attempt.outputs[-1]) if attempt.codes[-1] == 0 else None


def near(estimate, truth, least):
    return abs(estimate["value"] - truth) <= max(3 * estimate["standard_deviation"], least)


@situation("m-payload", "Kinovarobotics/kinova-ros#170",
           "The hand holds 0.9 kg. Mass and centre are asked for by the robot's settings.",
           "mass within 3 σ of 0.9 kg and 0.05 kg, centre within 3 σ or 5 mm of (20, −10, 60) mm"
           " in the frame of link_6")
def m_payload(attempt, base):
    found = load_run(attempt, base, 0.9, (0.02, -0.01, 0.06), "--frame", "link_6")
    if found is None:
        return False, answer(attempt)
    # The centre stands in the named frame; `centre_m` of the load is in an internal one.
    mass, centre = found["load"]["mass_kg"], found["centre_of_mass"]["centre_m"]
    right = near(mass, 0.9, 0.0) and abs(mass["value"] - 0.9) < 0.05 and all(
        c and near(c, x, 0.005) for c, x in zip(centre, (0.02, -0.01, 0.06)))
    place = ", ".join(f"{1000 * c['value']:.1f}" if c else "?" for c in centre)
    return right, (f"{mass['value']:.3f} ± {mass['standard_deviation']:.3f} kg"
                   f" at ({place}) mm")


@situation("m-declared-payload", "droid-dataset/droid#72",
           "Declared is the gripper, 0.9 kg at (0, 0, 57) mm; a camera of 0.25 kg was added.",
           "the declared load is contradicted, and 1.15 kg are found within 3 σ and 0.05 kg")
def m_declared(attempt, base):
    centre = scale(1 / 1.15, add(scale(0.9, (0, 0, 0.057)), scale(0.25, (0.07, 0, 0.04))))
    declared = ("--declared-mass-kg", "0.9", "--declared-centre-m", "0,0,0.057")
    found = load_run(attempt, base, 1.15, centre, *declared)
    if found is None:
        return False, answer(attempt)
    mass = found["load"]["mass_kg"]
    attempt.run("payload", "--cell", "cell.toml", "--result", "result.json", "--input", "load.csv",
                *declared)
    words = ("contradict", "differs from the declared", "outside", "not the declared",
             "disagree", "does not agree")
    right = near(mass, 1.15, 0.0) and abs(mass["value"] - 1.15) < 0.05
    lines = [x.strip() for x in attempt.outputs[-1].splitlines() if "declared" in x.lower()]
    return right and any(w in attempt.outputs[-1].lower() for w in words), (
        f"{mass['value']:.3f} ± {mass['standard_deviation']:.3f} kg; " + short("; ".join(lines)))


def read_chain(text):
    """The revolute joints and bodies of an exported URDF, fixed joints aside."""
    import xml.etree.ElementTree as tree
    robot = tree.fromstring(text)
    bodies = {}
    for link in robot.findall("link"):
        inertial = link.find("inertial")
        if inertial is not None:
            origin = inertial.find("origin")
            place = origin.get("xyz", "0 0 0") if origin is not None else "0 0 0"
            bodies[link.get("name")] = (
                float(inertial.find("mass").get("value")), tuple(map(float, place.split())))
    chain = []
    for joint in robot.findall("joint"):
        if joint.get("type") != "revolute":
            continue
        origin = joint.find("origin")
        vector = [tuple(map(float, origin.get(key, "0 0 0").split())) for key in ("xyz", "rpy")]
        mass, centre = bodies.get(joint.find("child").get("link"), (0.0, (0.0, 0.0, 0.0)))
        axis = tuple(map(float, joint.find("axis").get("xyz").split()))
        chain.append(Joint(joint.get("name"), *vector, axis, (0, 0, 0, 0), mass, centre,
                           (0, 0, 0, 0, 0, 0)))
    return chain


@situation("m-export", "ROAM-Lab-ND/spatial_v2_extended#17",
           "The identified arm is needed as full bodies in a URDF, for gravity compensation.",
           "gravity torques of the exported URDF within 2 % of the largest of each joint, at 200"
           " random postures, and all masses are positive")
def m_export(attempt, base):
    attempt.table(base.csv)
    attempt.run("export", "--cell", "cell.toml", "--result", "result.json", "--to", "urdf",
                "--out", "model.urdf")
    path = attempt.folder / "model.urdf"
    if not path.is_file():
        return False, answer(attempt)
    mine, truth = read_chain(path.read_text()), arm()
    generator = random.Random(SEED)
    still = [0.0] * 6
    errors, largest = [0.0] * 6, [1e-9] * 6
    for _ in range(200):
        q = [generator.uniform(j.lower, j.upper) for j in truth]
        exact = inverse_dynamics(truth, q, still, still)
        found = inverse_dynamics(mine, q, still, still)
        errors = [max(a, abs(x - y)) for a, x, y in zip(errors, found, exact)]
        largest = [max(a, abs(x)) for a, x in zip(largest, exact)]
    share = [e / s for e, s in zip(errors, largest)]
    share[0] = 0.0  # the first axis is vertical: gravity has no torque about it
    return max(share) <= 0.02 and all(j.mass > 0 for j in mine), (
        f"at most {100 * max(share):.2g} % of the largest gravity torque off; masses "
        + ", ".join(f"{j.mass:.2f}" for j in mine) + " kg")


@situation("m-warm", "stack-of-tasks/sot-torque-control#4",
           "In summer the friction has changed: viscous friction is 30 % smaller.",
           "`predict` says that the error is above the expected one; a new result has the smaller"
           " friction within 3 combined σ")
def m_warm(attempt, base):
    warm = Drives(DRIVES.ia, [0.7 * x for x in DRIVES.fv], DRIVES.fc, DRIVES.offset)
    attempt.table(base.csv)
    chain = arm()
    run = record(chain, warm, motions=fourier(chain, 24.0, random.Random(77)), seed=79)
    attempt.write("warm.csv", table(run))
    attempt.run("predict", "--cell", "cell.toml", "--result", "result.json", "--input", "warm.csv")
    found = re.search(r"error is ([\d.]+) times the expected", attempt.outputs[-1])
    factor = float(found.group(1)) if found else 0.0
    attempt.identify("warm.csv", out="warm.json")
    right, text = is_true(attempt, warm, result=attempt.result("warm.json"))
    return right and factor > 2, f"{factor} times the expected error; {text}"


# ---- bags of ROS 2


@situation("b-nan-effort", "kroshu/kuka_drivers#254",
           "The driver fills `effort` with NaN.", "refused: the bag has no efforts")
def b_nan(attempt, base):
    attempt.bag(states(base.run, arm(), lambda n, q, v, e: (n, q, v, [math.nan] * 6)))
    return is_refused(attempt, ("lack the effort", "no effort", "without effort"))


@situation("b-tiny-effort", "ROBOTIS-GIT/open_manipulator#294",
           "Efforts of 1e-308: memory that was never written.",
           "refused, or usable for nothing, and the efforts are named as constant or 0")
def b_tiny(attempt, base):
    generator = random.Random(SEED)
    attempt.bag(states(base.run, arm(), lambda n, q, v, e: (
        n, q, v, [generator.uniform(-3, 3) * 1e-308 for _ in e])),
        ('data.bag.effort.unit="Nm"', "data.bag.effort.sign=1"))
    return is_not_usable(attempt, ("effort", "torque"), ("constant", "zero", "are 0", "is 0",
                                                         "in all"))


@situation("b-other-joints", "ros-controls/ros2_controllers#1572",
           "Wheels and fingers are in the same message, with NaN for them alone; the order is"
           " another in each recording.", SAME)
def b_others(attempt, base):
    def edit(names, q, v, e):
        mixed = [2, 0, 5, 1, 3, 4]
        names = ["wheel_left_joint"] + [names[i] for i in mixed] + ["finger_joint"]
        return (names, [7.1] + [q[i] for i in mixed] + [0.01],
                [math.nan] + [v[i] for i in mixed] + [0.0],
                [math.nan] + [e[i] for i in mixed] + [math.nan])
    attempt.bag(states(base.run, arm(), edit))
    return is_same(attempt, base.plain)


@situation("b-two-publishers", "automaticaddison/yahboom_rosmaster#4",
           "Two nodes publish the joints on one topic, one of them zeros and no effort.",
           "refused with both publishers as the cause; or " + SAME + ", with a note")
def b_two(attempt, base):
    def messages():
        for stamp, message in states(base.run, arm()):
            yield stamp, message
            names = [j.name for j in arm()]
            yield stamp + 1_000_000, joint_state(stamp + 1_000_000, names[::-1], [0.0] * 6, [], [])
    attempt.bag(messages())
    if attempt.result():
        right, text = is_same(attempt, base.plain)
        return right and mentions(attempt, ("publisher", "without effort", "no effort")), text
    return is_refused(attempt, ("publisher", "two nodes"))


@situation("b-split", "ika-rwth-aachen/ros2_unbag#32",
           "The recorder began a new file after some minutes: a folder of three files.", SAME)
def b_split(attempt, base):
    attempt.write("arm.urdf", urdf(arm()))
    folder = attempt.folder / "run"
    folder.mkdir(exist_ok=True)
    messages = list(states(base.run, arm()))
    size = len(messages) // 3
    files = []
    for part in range(3):
        name = f"run_{part}.db3"
        end = None if part == 2 else (part + 1) * size
        bag(folder / name, messages[part * size:end])
        files.append(f"    - {name}")
    attempt.write("run/metadata.yaml", "\n".join(
        ["rosbag2_bagfile_information:", "  version: 5", "  storage_identifier: sqlite3",
         "  relative_file_paths:", *files, f"  message_count: {len(messages)}", ""]))
    attempt.new("--robot", "arm.urdf", "--bag", "run")
    attempt.identify("run")
    return is_same(attempt, base.plain)


@situation("b-file-compression", "ros2/ros2#1476",
           "Recorded with `--compression-mode file`: a `.db3.zstd`.",
           "the parameters of the plain recording; or refused with Zstandard and the command that"
           " unpacks it")
def b_zstd(attempt, base):
    attempt.write("arm.urdf", urdf(arm()))
    bag(attempt.folder / "whole.db3", states(base.run, arm()))
    attempt.write("run.db3.zstd", zstd_stored((attempt.folder / "whole.db3").read_bytes()))
    attempt.new("--robot", "arm.urdf", "--bag", "run.db3.zstd")
    attempt.identify("run.db3.zstd")
    if attempt.result():
        return is_same(attempt, base.plain)
    right = any(attempt.codes) and "zst" in attempt.text.lower().replace("run.db3.zstd", "")
    return right, answer(attempt)


@situation("b-no-names", "PlotJuggler/PlotJuggler#1373",
           "To save bandwidth the driver leaves `name` empty.",
           "refused: the messages have no names of joints")
def b_no_names(attempt, base):
    attempt.bag(states(base.run, arm(), lambda n, q, v, e: ([], q, v, e)))
    return is_refused(attempt, "name", ("empty", "no name", "without", "none"))


@situation("b-gaps", "Hilti-Research/hilti-slam-challenge-2021#6",
           "The disk was too slow: two stretches of a second are missing.",
           "the gaps are named; " + TRUTH)
def b_gaps(attempt, base):
    kept = [m for t, m in zip(base.run.t, states(base.run, arm()))
            if not 6.0 < t < 7.0 and not 15.0 < t < 16.1]
    attempt.bag(kept)
    right, text = is_true(attempt)
    return right and mentions(attempt, ("gap", "missing", "cut")), text


# ---- logs of a bus


CELL = "config/cells/tx40-cia402.toml"
EDS_CELL = "config/cells/tx40-cia402-eds.toml"
DBC = "config/dbc/cia402_six_axes.dbc"
EDS = "config/eds/cia402_drive.eds"


def bus(attempt, log, cell=CELL, edit=None):
    """Identifies a log with a copy of the shipped files, of which `edit` changes some."""
    shutil.copytree(ROOT / "config", attempt.folder / "config", dirs_exist_ok=True)
    for name, change in (edit or {}).items():
        attempt.write(name, change((attempt.folder / name).read_text()))
    attempt.write("drive.log", log)
    attempt.identify("drive.log", cell=cell)


def is_same_bus(attempt, expected):
    result = attempt.result()
    if result is None:
        return False, answer(attempt)
    worst = compare(result, expected)
    return worst < 1e-6, f"{answer(attempt, result)}; at most {worst:.1g} σ off"


@situation("c-error-frames", "cantools/cantools#817",
           "Error frames of the controller are among the frames of the candump log.",
           "the parameters of the log without them, exactly")
def c_errors(attempt, base):
    lines = []
    for index, line in enumerate(base.log.splitlines()):
        lines.append(line)
        if index % 997 == 500:
            lines.append(line.split()[0] + " can0 20000004#0004000000000000")
    bus(attempt, "\n".join(lines) + "\n")
    return is_same_bus(attempt, base.bus)


@situation("c-remote-frames", "linux-can/can-utils#359",
           "Remote requests (`#R8`) are among the frames, with an identifier of a drive.",
           "the parameters of the log without them, exactly; or refused with the remote frames")
def c_remote(attempt, base):
    lines = []
    for index, line in enumerate(base.log.splitlines()):
        lines.append(line)
        if index % 997 == 500:
            lines.append(line.split()[0] + " can0 183#R8")
    bus(attempt, "\n".join(lines) + "\n")
    return is_same_bus(attempt, base.bus) if attempt.result() else is_refused(attempt, "remote")


@situation("c-direction", "smartgauges/obd2-bt-stm32#2",
           "Every line ends with the direction, `R` or `T`.",
           "the parameters of the log without it, exactly")
def c_direction(attempt, base):
    lines = [line + (" T" if "can0 20" in line else " R") for line in base.log.splitlines()]
    bus(attempt, "\n".join(lines) + "\n")
    return is_same_bus(attempt, base.bus)


@situation("c-loopback", "autowarefoundation/ros2_socketcan#45",
           "Every frame is in the log twice, 20 µs apart: the sender heard itself.",
           "refused with the doubled frames as the cause; or the parameters of the plain log, with"
           " the count of the doubled frames")
def c_loopback(attempt, base):
    lines = []
    for line in base.log.splitlines():
        stamp, rest = line[1:].split(")", 1)
        seconds, nanos = stamp.split(".")
        lines += [line, f"({seconds}.{int(nanos) + 20000:09d}){rest}"]
    bus(attempt, "\n".join(lines) + "\n")
    words = ("twice", "doubled", "duplicate", "repeated", "second sender", "two senders")
    if attempt.result() is None:
        return is_refused(attempt, words)
    right, text = is_same_bus(attempt, base.bus)
    counted = json.dumps(attempt.result().get("unused_frames"))
    return right and (mentions(attempt, words) or any(w in counted for w in words)), text


@situation("c-savvycan", "collin80/SavvyCAN#125",
           "The log is the CSV of SavvyCAN.",
           "the parameters of the plain log; or refused with the kind of file and a format to"
           " export")
def c_savvycan(attempt, base):
    rows = ["Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8,"]
    for stamp, identifier, data in frames(base.log):
        data = [data[i:i + 2] for i in range(0, len(data), 2)]
        rows.append(f"{round(float(stamp) * 1e6)},{int(identifier, 16):08X},false,Rx,0,{len(data)},"
                    + "".join(x + "," for x in data))
    bus(attempt, "\n".join(rows) + "\n")
    if attempt.result():
        right, text = compare(attempt.result(), base.bus) < 0.1, answer(attempt)
        return right, text
    return is_refused(attempt, ("savvycan", "csv", "table"), ("candump", "asc", "trc"))


@situation("c-float", "cantools/cantools#20",
           "The positions are IEEE floats: `SIG_VALTYPE_` in the DBC file.",
           "the parameters of the plain log, exactly")
def c_float(attempt, base):
    lines = []
    for stamp, identifier, data in frames(base.log):
        if identifier.startswith("18"):
            raw = bytes.fromhex(data)
            value = float(struct.unpack("<i", raw[2:6])[0])
            data = (raw[:2] + struct.pack("<f", value) + raw[6:]).hex().upper()
        lines.append(LINE.format(stamp, identifier, data))
    types = "".join(f"SIG_VALTYPE_ {385 + i} PositionActualValue : 1;\n" for i in range(6))
    bus(attempt, "\n".join(lines) + "\n", edit={DBC: lambda text: text + "\n" + types})
    return is_same_bus(attempt, base.bus)


@situation("c-extended", "cantools/cantools#227",
           "The drives send 29-bit identifiers; the DBC file marks them by bit 31.",
           "the parameters of the plain log, exactly")
def c_extended(attempt, base):
    lines = [LINE.format(stamp, f"18FF{identifier:>04}" if identifier.startswith("18")
                         else identifier, data) for stamp, identifier, data in frames(base.log)]

    def edit(text):
        for i in range(385, 391):
            text = re.sub(rf"\b{i} TPDO", f"{0x98FF0000 + i} TPDO", text)
            text = re.sub(rf"\b(BO_|SG_) {i}\b", rf"\1 {0x98FF0000 + i}", text)
            text += f'BA_ "VFrameFormat" BO_ {0x98FF0000 + i} 1;\n'
        return text
    bus(attempt, "\n".join(lines) + "\n", edit={DBC: edit})
    return is_same_bus(attempt, base.bus)


@situation("c-extended-unmarked", "cantools/cantools#301",
           "As c-extended, but the DBC file lacks bit 31: 0x18FF0181 as a standard identifier.",
           "refused: the message and its identifier of more than 11 bits")
def c_unmarked(attempt, base):
    def edit(text):
        for i in range(385, 391):
            text = re.sub(rf"\b{i} TPDO", f"{0x18FF0000 + i} TPDO", text)
            text = re.sub(rf"\b(BO_|SG_) {i}\b", rf"\1 {0x18FF0000 + i}", text)
        return text
    bus(attempt, base.log, edit={DBC: edit})
    return is_refused(attempt, "TPDO1_1", ("11 bit", "11-bit", "standard identifier", "bit 31",
                                           "extended", "2047"))


@situation("c-motorola", "rbei-etas/busmaster#299",
           "Positions and torques are big-endian (Motorola).",
           "the parameters of the plain log, exactly")
def c_motorola(attempt, base):
    lines = []
    for stamp, identifier, data in frames(base.log):
        if identifier.startswith("18"):
            raw = bytes.fromhex(data)
            data = (raw[:2] + raw[2:6][::-1] + raw[6:][::-1]).hex().upper()
        lines.append(LINE.format(stamp, identifier, data))

    def edit(text):
        return replaced(text, ("PositionActualValue : 16|32@1-", "PositionActualValue : 23|32@0-"),
                        ("TorqueDemand : 48|16@1-", "TorqueDemand : 55|16@0-"))
    bus(attempt, "\n".join(lines) + "\n", edit={DBC: edit})
    return is_same_bus(attempt, base.bus)


@situation("c-eds-node", "canopen-python/canopen#198",
           "An editor wrote the COB-ID as `0x180+$NODEID`.",
           "the parameters of the plain device file, exactly")
def c_eds_node(attempt, base):
    def edit(text):
        return re.sub(r"(?i)\$NODEID\s*\+\s*(0x[0-9a-f]+)", r"\1+$NODEID", text)
    bus(attempt, base.log, EDS_CELL, {EDS: edit})
    return is_same_bus(attempt, base.eds)


@situation("c-eds-vendor", "canopen-python/canopen#313",
           "`VendorNumber=001`, which matters to nobody here.",
           "the parameters of the plain device file, exactly")
def c_eds_vendor(attempt, base):
    bus(attempt, base.log, EDS_CELL, {EDS: lambda text: replaced(
        text, ("VendorNumber=0\n", "VendorNumber=001\n"))})
    return is_same_bus(attempt, base.eds)


# ---------------------------------------------------------------------------- ten loggers

LOGGERS = []


def logger(name, form, *answers):
    """Registers a function that writes `arm.urdf` and the recording, and returns options of `new`."""
    def register(function):
        LOGGERS.append((name, form, answers, function))
        return function
    return register


def rows_of(run):
    return zip(run.t, run.q, run.v, run.torque)


CONSTANTS = [12.1, 12.1, 9.0, 3.2, 3.2, 3.2]


@logger("UR, RTDE client `record.py`", "blanks, 500 Hz, currents and modelled moments",
        "urdf.drive_inertia=true", 'data.side="joint"', f"data.torque.per_ampere={CONSTANTS}")
def log_rtde(attempt):
    run = record(arm(), rate=500.0, seconds=20.0)
    attempt.write("arm.urdf", named_arm())
    keys = ("actual_q", "actual_qd", "actual_current", "target_moment")
    lines = ["timestamp " + " ".join(f"{key}_{i}" for key in keys for i in range(6))]
    chain = arm()
    for k, (t, q, v, e) in enumerate(rows_of(run)):
        moment = inverse_dynamics(chain, q, v, run.a[k])
        current = [x / c for x, c in zip(e, CONSTANTS)]
        lines.append(f"{512345.678 + t:.6f} " + " ".join(
            f"{x:.6f}" for values in (q, v, current, moment) for x in values))
    attempt.write("robot_data.csv", "\n".join(lines) + "\n")
    return "robot_data.csv", ("--log", "robot_data.csv")


def seven():
    """Seven axes with torque sensors, and their small friction."""
    chain = arm()
    elbow = Joint("joint_3a", (0, 0, 0.02), (0, 0, 0), (0, 0, 1), (-2.9, 2.9, 3, 160),
                  1.8, (0.01, 0.02, 0.1), (0.02, 0, 0, 0.02, 0, 0.006))
    chain = chain[:2] + [elbow] + chain[2:]
    drives = Drives([0.0] * 7, [0.4] * 3 + [0.2] * 4, [0.5] * 3 + [0.2] * 4, [0.05] * 7)
    return chain, drives


@logger("KUKA LBR iiwa, Sunrise DataRecorder", "`%` header, blanks, seconds and nanoseconds",
        "urdf.drive_inertia=false")
def log_sunrise(attempt):
    chain, drives = seven()
    run = record(chain, drives, seconds=20.0, rate=200.0)
    attempt.write("arm.urdf", urdf(chain, "iiwa"))
    names = [f"{key}_LBR_iiwa_7_R800_1[{i}]" for key in ("axisTauMsr", "axisQMsr")
             for i in range(7)]
    lines = ["%ZeitInSec ZeitInNanoSec " + " ".join(names)]
    for t, q, _, e in rows_of(run):
        nanos = 1_700_000_000_500_000_000 + round(t * 1e9)
        lines.append(f"{nanos // 10**9} {nanos % 10**9} " + " ".join(
            f"{x:.9g}" for x in e + q))
    attempt.write("LogFile_1.log", "\n".join(lines) + "\n")
    return "LogFile_1.log", ("--log", "LogFile_1.log")


@logger("Franka, Python and pandas", "lists in cells",
        "urdf.drive_inertia=false")
def log_franka(attempt):
    chain, drives = seven()
    run = record(chain, drives, seconds=16.0, rate=500.0)
    attempt.write("arm.urdf", urdf(chain, "fr3"))
    lines = [",time,q,dq,tau_J,tau_ext_hat_filtered"]
    for k, (t, q, v, e) in enumerate(rows_of(run)):
        cells = (q, v, e, [0.01 * math.sin(t + i) for i in range(7)])
        lines.append(f"{k},{t:.3f}," + ",".join(
            '"[' + ", ".join(f"{x:.8g}" for x in cell) + ']"' for cell in cells))
    attempt.write("run.csv", "\n".join(lines) + "\n")
    return "run.csv", ("--log", "run.csv")


@logger("ROS 2, `ros2 bag record` (SQLite)", "joint states by alphabet, jitter of the stamps",
        "urdf.drive_inertia=true")
def log_rosbag(attempt):
    chain = arm()
    for joint, name in zip(chain, UR_NAMES):
        joint.name = name
    run = record(chain, rate=200.0)
    generator = random.Random(SEED)
    attempt.write("arm.urdf", urdf(chain))

    def edit(names, q, v, e):
        return tuple([values[i] for i in ALPHABET] for values in (names, q, v, e))
    run.t = [t + generator.uniform(-2e-4, 2e-4) for t in run.t]
    exact = record(chain, rate=200.0, noise=False)
    motions = fourier(chain, 24.0, random.Random(SEED))
    for k, t in enumerate(run.t):
        moved = [state(m, t)[0] - x for m, x in zip(motions, exact.q[k])]
        run.q[k] = [x + d for x, d in zip(run.q[k], moved)]
    (attempt.folder / "run").mkdir(exist_ok=True)
    bag(attempt.folder / "run" / "run_0.db3", states(run, chain, edit))
    attempt.write("run/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n"
                  "  storage_identifier: sqlite3\n  relative_file_paths:\n    - run_0.db3\n")
    return "run", ("--bag", "run")


@logger("PlotJuggler, CSV export", "names with slashes, rows of another topic between",
        "urdf.drive_inertia=true")
def log_plotjuggler(attempt):
    run = record(arm(), rate=250.0)
    attempt.write("arm.urdf", named_arm())
    keys = ("position", "velocity", "effort")
    lines = ["__time,/tf/x," + ",".join(
        f"/joint_states/{UR_NAMES[i]}/{key}" for i in ALPHABET for key in keys)]
    for k, (t, q, v, e) in enumerate(rows_of(run)):
        lines.append(f"{1756300000 + t:.6f},," + ",".join(
            f"{values[i]:.9f}" for i in ALPHABET for values in (q, v, e)))
        if k % 5 == 2:
            lines.append(f"{1756300000.001 + t:.6f},{k}.000000000" + "," * 18)
    attempt.write("export.csv", "\n".join(lines) + "\n")
    return "export.csv", ("--log", "export.csv")


@logger("Beckhoff, TwinCAT Scope export", "tabs, lines before the header, a time per channel, °",
        "urdf.drive_inertia=true")
def log_twincat(attempt):
    run = record(arm(), rate=500.0, seconds=20.0)
    attempt.write("arm.urdf", urdf(arm()))
    names = [f"Axes.Axis{i}.NcToPlc.ActPos" for i in range(1, 7)] + [
        f"GVL.Axis{i}.TorqueNm" for i in range(1, 7)]
    lines = ["Name\tScope Project", "File\tC:\\Scope\\run.tcscopex",
             "Starttime of export\t133412345678900000", "", "\t".join(
                 f"Name\t{name}" for name in names),
             "\t".join("Data-Type\tREAL64" for _ in names),
             "\t".join("SampleTime[ms]\t2" for _ in names), ""]
    for t, q, _, e in rows_of(run):
        lines.append("\t".join(f"{1000 * t:.0f}\t{x:.6f}" for x in [
            math.degrees(y) for y in q] + e))
    attempt.write("run.csv", "\r\n".join(lines) + "\r\n")
    return "run.csv", ("--log", "run.csv")


@logger("MATLAB, `writetimetable`", "times as `0.004 sec`",
        "urdf.drive_inertia=true")
def log_matlab(attempt):
    run = record(arm(), rate=250.0)
    attempt.write("arm.urdf", urdf(arm()))
    lines = ["Time," + ",".join([f"q_{i}" for i in range(1, 7)] + [
        f"tau_{i}" for i in range(1, 7)])]
    for t, q, _, e in rows_of(run):
        lines.append(f"{t:.6g} sec," + ",".join(f"{x:.15g}" for x in q + e))
    attempt.write("run.csv", "\r\n".join(lines) + "\r\n")
    return "run.csv", ("--log", "run.csv")


@logger("Kinova Kortex, Python", "° from 0 to 360, continuous joints, the sign of the torques",
        "urdf.drive_inertia=true")
def log_kortex(attempt):
    run = record(arm(), rate=100.0)
    text = urdf(arm())
    for i in (1, 4, 6):
        text = text.replace(f'name="joint_{i}" type="revolute"', f'name="joint_{i}"'
                            ' type="continuous"')
    attempt.write("arm.urdf", text)
    lines = ["time," + ",".join(f"actuator{i}_{key}" for i in range(1, 7)
                                for key in ("position", "velocity", "torque", "current_motor"))]
    for t, q, v, e in rows_of(run):
        lines.append(f"{1756300000 + t:.3f}," + ",".join(
            f"{math.degrees(q[i]) % 360:.4f},{math.degrees(v[i]):.4f},{-e[i]:.4f},{e[i] / 9:.4f}"
            for i in range(6)))
    attempt.write("kortex.csv", "\n".join(lines) + "\n")
    return "kortex.csv", ("--log", "kortex.csv")


RATED = [0.3, 0.3, 0.15, 0.05, 0.05, 0.03]
GAINS = ["urdf.drive_inertia=true", "urdf.gear_ratios=[1, 1, 1, 1, 1, 1]",
         'bus.layout.torque.valid="instant"']
GAINS += [
    f"bus.drives.position.scale={{ counts_per_revolution = {2**22}.0 }}",
    "bus.drives.position.sign=1",
    "bus.drives.position.zero=0",
    'bus.drives.position.provenance="encoder"',
    "bus.drives.torque.sign=1",
    'bus.drives.torque.provenance="name plate"',
] + [
    f"bus.drives.{axis}.torque.scale={{ per_mille_of_rated_torque ="
    f" {{ rated_torque_nm = {1000 * share} }} }}"
    for axis, share in enumerate(RATED, 1)
]


def drive_frames(run):
    """The frames of six CiA 402 drives: a SYNC, then status, position and torque of each."""
    for k, (t, q, _, e) in enumerate(rows_of(run)):
        yield t, 0x80, b""
        for i in range(6):
            count = round(q[i] / (2 * math.pi) * 2**22)
            torque = round(e[i] / RATED[i])
            yield t + 1e-4 * (i + 1), 0x181 + i, struct.pack("<Hih", 0x1237, count, torque)
        for i in range(6):
            count = round(q[i] / (2 * math.pi) * 2**22)
            yield t + 1e-4 * (i + 8), 0x201 + i, struct.pack("<Hih", 0x000F, count, 0)


@logger("candump, CANopen drives with an EDS", "SYNC and PDOs at 500 Hz", *GAINS)
def log_candump(attempt):
    run = record(arm(), rate=500.0, seconds=16.0)
    attempt.write("arm.urdf", urdf(arm()))
    shutil.copy(ROOT / EDS, attempt.folder / "drive.eds")
    lines = [f"({1756300000 + t:.6f}) can0 {identifier:03X}#{data.hex().upper()}"
             for t, identifier, data in drive_frames(run)]
    attempt.write("candump.log", "\n".join(lines) + "\n")
    return "candump.log", ("--eds", "drive.eds", "--log", "candump.log")


@logger("PEAK PCAN-View, trace 2.1, with a DBC", "SYNC and PDOs at 500 Hz", *GAINS)
def log_peak(attempt):
    run = record(arm(), rate=500.0, seconds=16.0)
    attempt.write("arm.urdf", urdf(arm()))
    shutil.copy(ROOT / DBC, attempt.folder / "drives.dbc")
    lines = [";$FILEVERSION=2.1", ";$STARTTIME=45950.5", ";$COLUMNS=N,O,T,B,I,d,R,L,D", ";"]
    for n, (t, identifier, data) in enumerate(drive_frames(run), 1):
        lines.append(f"{n:7d} {1000 * t:13.3f} DT 1     {identifier:04X} Rx -  {len(data)}    "
                     + " ".join(f"{x:02X}" for x in data))
    attempt.write("trace.trc", "\r\n".join(lines) + "\r\n")
    return "trace.trc", ("--dbc", "drives.dbc", "--log", "trace.trc")


def try_loggers(out, program):
    print(head("logger", "file", "answers", "result"))
    for index, (name, form, answers, function) in enumerate(LOGGERS, 1):
        attempt = Attempt(out / f"logger-{index}", program)
        attempt.folder.mkdir(parents=True, exist_ok=True)
        recording, options = function(attempt)
        (attempt.folder / "cell.toml").unlink(missing_ok=True)
        settings = [option for one in answers for option in ("--set", one)]
        attempt.run("new", "cell.toml", "--robot", "arm.urdf", *options, *settings)
        attempt.identify(recording, "--report", "report.html")
        done = (attempt.folder / "report.html").is_file()
        text = answer(attempt)
        if done:
            small = "urdf.drive_inertia=false" in answers
            drives = seven()[1] if small else DRIVES
            text = is_true(attempt, drives, not small)[1]
        print(f"| {name} | {form} | {len(answers)} | {'report; ' if done else ''}"
              f"{plain(text)} |", flush=True)
        attempt.write("answers.txt", f"{attempt.codes}\n{attempt.text}")


# ---------------------------------------------------------------------------- the run


class Base:
    """The plain recordings and what the program makes of them: every situation is compared."""

    def __init__(self, out, program):
        self.run = record(arm())
        chain = arm()
        self.second = record(chain, motions=fourier(chain, 24.0, random.Random(77)), seed=78)
        self.csv = table(self.run)
        attempt = Attempt(out / "plain", program)
        attempt.table(self.csv)
        self.plain = attempt.result()
        right, text = is_true(attempt)
        assert right, f"the plain recording: {text}"
        shutil.copytree(ROOT / "config", attempt.folder / "config", dirs_exist_ok=True)
        assert attempt.run("sim", "--cell", CELL, "--bus", "log:plain.log") == 0
        self.log = (attempt.folder / "plain.log").read_text()
        attempt.identify("plain.log", cell=CELL, out="bus.json")
        attempt.identify("plain.log", cell=EDS_CELL, out="eds.json")
        self.bus, self.eds = attempt.result("bus.json"), attempt.result("eds.json")
        print(f"plain recording: {text}\n", file=sys.stderr)


def link(source):
    if source.startswith("www."):
        return f"[{source.split('/')[0]}](https://{source})"
    repository, thread = source.split("#")
    return f"[{source}](https://github.com/{repository}/issues/{thread})"


def head(*columns):
    return f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}"


def plain(text):
    """The text for a field of a table."""
    return text.replace("|", "/").replace("<", "&lt;")


def expected_table():
    print(head("situation", "source", "input", "expected answer"))
    for identifier, source, sentence, expected, _ in SITUATIONS:
        print(f"| {identifier} | {link(source)} | {sentence} | {expected} |")


def try_all(out, program, only):
    base = Base(out, program)
    print(head("situation", "answer of the program", "judged"))
    count = {True: 0, False: 0}
    for identifier, _, _, _, function in SITUATIONS:
        if only and identifier not in only:
            continue
        attempt = Attempt(out / identifier, program)
        attempt.folder.mkdir(parents=True, exist_ok=True)
        right, text = function(attempt, base)
        count[bool(right)] += 1
        print(f"| {identifier} | {plain(text)} | {'right' if right else '**wrong**'} |",
              flush=True)
        attempt.write("answers.txt", f"{attempt.codes}\n{attempt.text}")
    print(f"\n{count[True]} right, {count[False]} wrong")


def main(arguments):
    if arguments == ["--expected"]:
        expected_table()
        return
    if len(arguments) < 2:
        sys.exit(__doc__)
    out = Path(arguments[0]).resolve()
    (out / "plain").mkdir(parents=True, exist_ok=True)
    program = str(Path(arguments[1]).resolve())
    if arguments[2:] == ["--loggers"]:
        try_loggers(out, program)
    else:
        try_all(out, program, arguments[2:])


if __name__ == "__main__":
    main(sys.argv[1:])
