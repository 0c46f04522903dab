#!/usr/bin/env python3
"""Wrong statements about recordings: whether they are named, and whether right ones are left alone.

    make.py list [simulated PROGRAM]         print the list of wrong statements, drawn with a fixed seed
    make.py run OUT PROGRAM [simulated]      make the inputs of the list, run all commands, print the table

Each statement changes one signal of a recording, or one value of the robot file. The real recordings (list.csv) are those of
tests/data, and the TX40 in the folder DIDIM_DATASETS, which has no licence and is not part of the project. The simulated ones
(list-simulated.csv) are of four arms of different makers along random motions, with the noise of their scenarios. Needs NumPy.
"""

import csv
import gzip
import json
import math
import os
import random
import re
import sqlite3
import struct
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
DATA = ROOT / "tests/data"
SEED = 20261128

CELL = """name = "study"
robot = "robot.toml"
[data]
rate_hz = {rate_hz}
torque_valid = "instant"
side = "{side}"
[data.position]
columns = {positions}
unit = {position_units}
[data.torque]
columns = {torques}
unit = {torque_units}
[identification]
method = "idim-ls"
position_filter = {{ cutoff_hz = {cutoff_hz} }}
decimation_filter = {{ factor = {factor} }}
"""

# ------------------------------------------------------------------------------------------ recordings


@dataclass
class Recording:
    """Positions [rad or m] and torques [N·m or N] of motors or joints (samples × axes)."""

    name: str
    robot: str
    motions: list
    second: tuple
    rate_hz: float
    side: str = "joint"
    cutoff_hz: float = 5.0
    factor: int = 10
    window: list = field(default_factory=list)
    joints: list = field(default_factory=list)
    prismatic: list = field(default_factory=list)
    truth: dict = field(default_factory=dict)

    @property
    def axes(self):
        return self.motions[0][0].shape[1]

    def moving(self):
        """Returns the axes that move, and whose torques are used. Counted from 0."""
        span = lambda axis: max(np.ptp(position[:, axis]) for position, _ in self.motions)
        return [axis for axis in range(self.axes) if span(axis) > 0.02 and (not self.joints or axis in self.joints)]


def signals(path, position, torque):
    with open(path, newline="") as file:
        names, *rows = csv.reader(file)
    values = np.array(rows, dtype=float)
    columns = lambda begin: values[:, [k for k, name in enumerate(names) if name.startswith(begin)]]
    return columns(position), columns(torque)


def kr300():
    motion = {name: signals(DATA / f"kr300/{name}.csv", "motor_position", "motor_torque") for name in "abc"}
    robot = (DATA / "kr300/robot.toml").read_text()
    for pair, second in (("ab", "c"), ("bc", "a"), ("ac", "b")):
        yield Recording(
            f"kr300-{pair}",
            robot,
            [motion[name] for name in pair],
            motion[second],
            250.0,
            side="motor",
            window=["--from", "1.8", "--to", "8.196"],
        )


def joint_states(path, names):
    """Returns positions and efforts of the joint states in a bag of SQLite, in the order of these names."""
    with tempfile.NamedTemporaryFile(suffix=".db3") as file:
        file.write(gzip.decompress(path.read_bytes()))
        file.flush()
        bag = sqlite3.connect(file.name)
        query = "select data from messages join topics on topics.id = topic_id where type like '%JointState' order by timestamp"
        messages = [data for (data,) in bag.execute(query)]
    rows = []
    for data in messages:
        at = 12

        def number():
            nonlocal at
            at = (at + 3) // 4 * 4 + 4
            return struct.unpack_from("<I", data, at - 4)[0]

        def text():
            nonlocal at
            count = number()
            at += count
            return data[at - count : at - 1].decode()

        def numbers():
            nonlocal at
            count = number()
            begin = (at - 4 + 7) // 8 * 8 + 4 if count else at
            at = begin + 8 * count
            return struct.unpack_from(f"<{count}d", data, begin)

        text()
        order = [text() for _ in range(number())]
        position, _, effort = numbers(), numbers(), numbers()
        if len(position) == len(effort) == len(names):
            places = [order.index(name) for name in names]
            rows.append([[position[k] for k in places], [effort[k] for k in places]])
    both = np.array(rows)
    return both[:, 0], both[:, 1]


def recordings():
    yield from kr300()
    names = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    position, torque = joint_states(DATA / "ur10/motion.db3.gz", [f"{name}_joint" for name in names])
    half = len(position) // 2
    motions = [(position[:half], torque[:half]), (position[half:], torque[half:])]
    yield Recording("ur10", (DATA / "ur10/robot.toml").read_text(), motions[:1], motions[1], 125.0)
    position, torque = signals(DATA / "tiago/motion.csv", "joint_position", "joint_torque")
    parts = [(position[part], torque[part]) for part in (slice(920, 4500), slice(4500, 6789))]
    robot = (DATA / "tiago/robot.toml").read_text()
    yield Recording("tiago", robot, parts[:1], parts[1], 100.0, joints=[1, 2, 3, 4], prismatic=[0])
    folder = Path(os.environ.get("DIDIM_DATASETS", "")) / "tx40"
    if (folder / "motor_position.csv").exists():
        read = lambda name: np.loadtxt(folder / f"motor_{name}.csv", delimiter=",", skiprows=1)
        position, torque = read("position"), read("torque")
        parts = [(position[part], torque[part]) for part in (slice(500, 24000), slice(24000, 37500))]
        robot = (ROOT / "config/robots/tx40.toml").read_text()
        yield Recording("tx40", robot, parts[:1], parts[1], 5000.0, side="motor", cutoff_hz=50.0, factor=50)
    else:
        print("tx40: left out, because DIDIM_DATASETS does not have it", file=sys.stderr)


# Robot, cell and scenario of the simulated arms.
SIMULATED = {
    "sim-tx40": ("tx40", "config/cells/tx40-cia402.toml", "tx40-paper"),
    "sim-piper": ("piper", "config/cells/piper.toml", "piper"),
    "sim-openarm": ("openarm", "config/cells/openarm.toml", "openarm"),
    "sim-ur5e": ("ur5e", "sim-fixtures/faults/cells/ur5e.toml", "ur5e"),
}
MOVES = 12
REACH = 0.6  # share of the range of a joint, about its middle,
MAX_REACH_RAD = 1.2  # and at most this far from it
EVERY = 5  # of the 5,000 samples a second are kept
CUTOFF_HZ = 100.0  # above 1.8 times that of the decimation filter, as didim check asks; the first run had 50


def random_moves(robot, draw):
    """The moves of a scenario to random postures, and back."""
    middles, reaches = [], []
    for joint in tomllib.loads(robot)["joint"]:
        low, high = (math.radians(joint[f"position_{end}_deg"]) for end in ("min", "max"))
        middles.append((low + high) / 2)
        reaches.append(min(REACH * (high - low) / 2, MAX_REACH_RAD))
    text = "moves = [\n"
    for move in range(MOVES):
        target = [round(middle + draw.uniform(-reach, reach), 3) for middle, reach in zip(middles, reaches)]
        if move == MOVES - 1:
            target = [0.0] * len(target)
        shares = [round(draw.uniform(0.5, 1.0), 2) for _ in range(2)]
        text += f"  {{ target_rad = {target}, velocity_fraction = {shares[0]}, acceleration_fraction = {shares[1]}, dwell_s = 0.1 }},\n"
    return text + "]"


def simulated(program):
    """Two random motions of each arm, with its true parameters."""
    for name, (robot_name, cell, scenario) in SIMULATED.items():
        draw = random.Random(f"{SEED}-{name}")
        robot = (ROOT / f"config/robots/{robot_name}.toml").read_text()
        text = (ROOT / f"sim-fixtures/scenarios/{scenario}.toml").read_text()
        text = re.sub(r"(?m)^samples = \d+$", "samples = 150000", text)
        motions = []
        for seed in (1, 2):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "scenario.toml"
                path.write_text(re.sub(r"(?ms)^moves = \[$.*?^\]$", lambda _: random_moves(robot, draw), text))
                line = [program, "sim", "--cell", ROOT / cell, "--scenario", path, "--seed", str(seed)]
                done = subprocess.run([*line, "--out", f"{folder}/out.csv", "--json"], capture_output=True, text=True)
                assert done.returncode == 0, done.stderr
                truth = {of["name"]: of["value"] for of in json.loads(done.stdout)["truth"]}
                position, torque = signals(f"{folder}/out.csv", "motor_position", "motor_torque")
                motions.append((position[::EVERY], torque[::EVERY]))
        rate_hz = 5000.0 / EVERY
        yield Recording(name, robot, motions[:1], motions[1], rate_hz, side="motor", cutoff_hz=CUTOFF_HZ, factor=10, truth=truth)


# ------------------------------------------------------------------------------------ wrong statements

SIZES = {
    "torque-scale": [0.5, 0.7, 1.3, 1.5, 2.0],
    "torque-unit": [0.01, 0.1, 10.0, 1000.0],
    "position-scale": [0.8, 0.9, 1.1, 1.2],
    "torque-delay": [0.02, 0.04, 0.06, 0.1],
    "position-delay": [0.04, 0.06, 0.1],
    "torque-low-pass": [0.05, 0.1, 0.15],
    "position-low-pass": [0.05, 0.1, 0.15],
    "zero": [5.0, 10.0, -8.0],
}


def wrong_statements(recording):
    """Returns kind, axes and size of each wrong statement about a recording."""
    draw = random.Random(f"{SEED}-{recording.name}")
    moving = recording.moving()
    for axis in moving:
        for signal in ("torque", "position", "both"):
            yield f"{signal}-sign", [axis], None
    pairs = [[one, other] for k, other in enumerate(moving) for one in moving[:k]]
    draw.shuffle(pairs)
    for kind, chosen in (("swap", pairs[:6]), ("torque-swap", pairs[6:10]), ("position-swap", pairs[10:14])):
        for pair in chosen or pairs[:3]:
            yield kind, pair, None
    for axis in moving:
        for kind, sizes in SIZES.items():
            yield kind, [axis], draw.choice(sizes)
    for size in (0.02, 0.05, 0.1):
        yield "torque-delay", moving, size
    for size in (0.05, 0.1):
        yield "low-pass", moving, size
    for axis, sign in ((2, 1), (0, 1), (1, -1), (0, -1)):
        yield "gravity", [axis], 9.81 * sign
    for size in (5.0, 15.0):
        yield "tilt", [0], size


def write_list(recordings):
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["recording", "kind", "axes", "size"])
    for recording in recordings:
        out.writerow([recording.name, "right", "", ""])
        for kind, axes, size in wrong_statements(recording):
            out.writerow([recording.name, kind, " ".join(str(axis + 1) for axis in axes), "" if size is None else size])


def low_pass(signal, time_constant):
    share, out = 1 - math.exp(-1 / time_constant), signal.copy()
    for k in range(1, len(signal)):
        out[k] = out[k - 1] + share * (signal[k] - out[k - 1])
    return out


def delayed(signal, samples):
    places = np.arange(len(signal))
    return np.interp(places - samples, places, signal)


def stated(statement, recording, motion):
    """Returns positions and torques as the statement has them."""
    kind, axes, size = statement
    position, torque = motion[0].copy(), motion[1].copy()
    of_kind = {"torque": [torque], "position": [position]}.get(kind.split("-")[0], [position, torque])
    for values in of_kind:
        if kind.endswith("sign"):
            values[:, axes] *= -1
        elif kind.endswith("swap"):
            values[:, axes] = values[:, axes[::-1]]
        elif kind.endswith(("scale", "unit")):
            values[:, axes] *= size
        elif kind.endswith(("delay", "low-pass")):
            change = delayed if kind.endswith("delay") else low_pass
            for axis in axes:
                values[:, axis] = change(values[:, axis], size * recording.rate_hz)
    if kind == "zero":
        # Positions of motors turn about a hundred times as far as those of joints.
        position[:, axes] += math.radians(size) * (100 if recording.side == "motor" else 1)
    return position, torque


def gravity(statement):
    kind, axes, size = statement
    if kind == "gravity":
        return [size if axis == axes[0] else 0.0 for axis in range(3)]
    if kind == "tilt":
        return [9.81 * math.sin(math.radians(size)), 0.0, -9.81 * math.cos(math.radians(size))]
    return None


# ---------------------------------------------------------------------------------------------- answers


def answer(program, recording, statement):
    """Runs `identify` and `predict`; returns errors, findings and uses."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        robot, base = recording.robot, gravity(statement)
        if base:
            robot, count = re.subn(r"(?m)^gravity_m_s2 = .*$", f"gravity_m_s2 = {base}", robot)
            assert count == 1
        (folder / "robot.toml").write_text(robot)
        columns = [[f"{letter}{axis + 1}" for axis in range(recording.axes)] for letter in "pt"]
        units = [[of[axis in recording.prismatic] for axis in range(recording.axes)] for of in (["rad", "m"], ["Nm", "N"])]
        quoted = dict(zip(["positions", "torques", "position_units", "torque_units"], map(json.dumps, columns + units)))
        (folder / "cell.toml").write_text(CELL.format(**quoted, **vars(recording)))

        def write(name, motion):
            values = np.hstack(stated(statement, recording, motion))
            header = ",".join(columns[0] + columns[1])
            np.savetxt(folder / name, values, delimiter=",", header=header, comments="", fmt="%.9g")
            return ["--input", name]

        def didim(command, *arguments):
            line = [program, command, "--cell", "cell.toml", "--json", *arguments, *recording.window]
            return subprocess.run(line, cwd=folder, capture_output=True, text=True)

        inputs = [write(f"{k}.csv", motion) for k, motion in enumerate(recording.motions)]
        joints = ["--joints", ",".join(str(joint + 1) for joint in recording.joints)] if recording.joints else []
        done = didim("identify", *sum(inputs, []), *joints)
        if not done.stdout.strip():
            return {"refused": done.stderr.strip().splitlines()[-1]}
        result = json.loads(done.stdout)
        (folder / "result.json").write_text(done.stdout)
        done = didim("predict", "--result", "result.json", *write("second.csv", recording.second))
        predicted = json.loads(done.stdout) if done.stdout.strip() else {}
        return {
            "per_joint": result["relative_error_per_joint"],
            "rms": result["rms_error_per_joint_nm"],
            "findings": [[of["code"], of.get("subject"), of.get("figure")] for of in result["verdict"]["findings"]],
            "uses": {name: (of["applicable"], of["figure"]) for name, of in result["verdict"]["uses"].items()},
            "prediction": result["verdict"]["uses"]["prediction"]["applicable"],
            "combined": {of["name"]: of["combined_standard_deviation"] for of in result["parameters"]},
            "values": {of["name"]: of["value"] for of in result["parameters"]},
            "held_out": [result["held_out"].get(key) for key in ("relative_error", "relative_error_per_joint")],
            "second": predicted.get("relative_error"),
            "second_per_joint": predicted.get("relative_error_per_joint", []),
        }


# Codes of causes, and the families of statements that they name.
CAUSES = {
    "wrong-signs": "sign",
    "wrong-signs-of-joint": "sign",
    "opposite-signal": "sign",
    "swapped-motors": "swap",
    "gravity-direction": "gravity",
    "gravity-removed": "no gravity",
    "low-passed": "lag",
    "late-signal": "lag",
    "torque-delay": "lag",
    "torque-gain": "torque scale",
    "other-unit": "torque scale",
    "position-scale": "position scale",
    "geometry": "zero",
    "frozen-position": "frozen",
    "clipped-torque": "clipped",
}
FAMILIES = {"unit": "torque scale", "delay": "lag", "low-pass": "lag", "tilt": "gravity"}


def family(kind):
    if kind.endswith("scale"):
        return kind.replace("-", " ")
    ends = [name for end, name in FAMILIES.items() if kind.endswith(end)]
    return ends[0] if ends else kind.split("-")[-1]


def judged(statement, found):
    """Returns how the first cause answers the statement."""
    kind, axes, _ = statement
    causes = [(code, subject) for code, subject, _ in found["findings"] if code in CAUSES]
    if not causes:
        return "nothing named"
    code, subject = causes[0]
    named = {number for of in ("joints", "motors") for number in (subject or {}).get(of, [])}
    if CAUSES[code] != family(kind):
        return "wrong"
    is_of_arm = kind in ("gravity", "tilt") or len(axes) > 2
    return "right" if is_of_arm or not named or named >= {axis + 1 for axis in axes} else "family"


def matters(found, right):
    """True if the error of a joint with 5 % of the largest torque is a quarter larger."""
    torques = [rms / error if error else 0.0 for rms, error in zip(right["rms"], right["per_joint"])]
    larger = [one is not None and own and one > 1.25 * own for one, own in zip(found["per_joint"], right["per_joint"])]
    return any(is_larger and torque >= 0.05 * max(torques) for is_larger, torque in zip(larger, torques))


ANSWERS = ["right", "family", "refused", "nothing named", "wrong"]


def beyond_truth(recording, found):
    """The parameters that are more than three combined standard deviations from the truth."""
    far = lambda name, value: abs(value - recording.truth[name]) > 3.0 * found["combined"][name]
    return [name for name, value in found["values"].items() if name in recording.truth and far(name, value)]


def run(out, program, chosen, listing):
    with open(HERE / listing, newline="") as file:
        listed = list(csv.DictReader(file))
    counts, harmful, untrue, answers = {}, [], [], []
    for recording in chosen:
        right = None
        for row in (row for row in listed if row["recording"] == recording.name):
            axes = [int(axis) - 1 for axis in row["axes"].split()]
            statement = (row["kind"], axes, float(row["size"]) if row["size"] else None)
            found = answer(program, recording, statement)
            if row["kind"] == "right":
                right = found
                causes = [code for code, *_ in found["findings"] if code in CAUSES]
                found["answer"] = "wrong" if causes else "nothing named"
                group = ("right recording", "")
            elif "refused" in found:
                found["answer"], group = "refused", ("matters", row["kind"])
            else:
                found["answer"] = judged(statement, found)
                group = ("matters" if matters(found, right) else "does not matter", row["kind"])
                if found["prediction"] and (found["second"] or 0.0) > 0.15:
                    harmful.append(row)
            if "refused" not in found and found["uses"]["physical-values"][0]:
                far = beyond_truth(recording, found)
                untrue += [(row, far)] if far else []
            counts.setdefault((*group, recording.name), Counter())[found["answer"]] += 1
            answers.append({**row, **found})
        print(f"{recording.name}: done", file=sys.stderr)
    Path(out).mkdir(parents=True, exist_ok=True)
    (Path(out) / "answers.json").write_text(json.dumps(answers, indent=1))
    for title, key in (("recording", 2), ("kind", 1)):
        print(f"\n| | {title} | statements | " + " | ".join(ANSWERS) + " |")
        print("|---|---|---|" + "---|" * len(ANSWERS))
        rows = {}
        for group, counter in counts.items():
            rows.setdefault((group[0], group[key]), Counter()).update(counter)
        for (group, name), counter in sorted(rows.items(), key=lambda row: (row[0][0] != "matters", row[0])):
            cells = " | ".join(str(counter[answer]) for answer in ANSWERS)
            print(f"| {group} | {name} | {sum(counter.values())} | {cells} |")
    print(f"\nPrediction allowed, and its error on the second motion above 15 %: {len(harmful)}")
    for row in harmful:
        print(f"- {row['recording']}: {row['kind']} {row['axes']} {row['size']}")
    print(f"\nPhysical values allowed, and one beyond three combined σ of the truth: {len(untrue)}")
    for row, far in untrue:
        print(f"- {row['recording']}: {row['kind']} {row['axes']} {row['size']}: {' '.join(far)}")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["list"]:
            write_list(recordings())
        case ["list", "simulated", program]:
            write_list(simulated(program))
        case ["run", out, program]:
            run(out, str(Path(program).resolve()), recordings(), "list.csv")
        case ["run", out, program, "simulated"]:
            run(out, str(Path(program).resolve()), simulated(program), "list-simulated.csv")
        case _:
            sys.exit(__doc__)
