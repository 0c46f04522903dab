"""Bags of joint states, by the MCAP library for Python (pip install mcap lz4 zstandard).

    /tmp/venv-golden/bin/python crates/formats/tests/golden/bag.py crates/formats/tests/golden

Three joints at 100 Hz on /joint_states, in another order in every second message, with stamps that jitter by a
millisecond; a gripper on the same topic between; one message twice; a gap of 50 ms after 1.5 s. Positions are sin(2 t + k),
efforts cos(3 t + k), with k = 0, 1, 2 of joints a, b, c.
"""

import math
import random
import struct
import sys
from pathlib import Path

from mcap.writer import CompressionType, Writer

random.seed(3)


def text(out, value):
    while (len(out) - 4) % 4:
        out += b"\0"
    data = value.encode() + b"\0"
    out += struct.pack("<I", len(data)) + data


def numbers(out, values):
    while (len(out) - 4) % 4:
        out += b"\0"
    out += struct.pack("<I", len(values))
    for value in values:
        while (len(out) - 4) % 8:
            out += b"\0"
        out += struct.pack("<d", value)


def joint_state(stamp, names, position, effort):
    out = bytearray(b"\0\1\0\0")
    nanoseconds = round(stamp * 1e9)
    out += struct.pack("<iI", nanoseconds // 10**9, nanoseconds % 10**9)
    text(out, "")
    while (len(out) - 4) % 4:
        out += b"\0"
    out += struct.pack("<I", len(names))
    for name in names:
        text(out, name)
    for values in (position, [], effort):
        numbers(out, values)
    return bytes(out)


def states():
    for k in range(200):
        if 150 <= k < 155:
            continue
        stamp = 1700000000 + k / 100 + random.uniform(-0.001, 0.001)
        t = stamp - 1700000000
        joints = [(n, math.sin(2 * t + i), math.cos(3 * t + i)) for i, n in enumerate("abc")]
        if k % 2:
            joints.reverse()
        yield stamp, joint_state(stamp, *zip(*joints))
        if k == 77:
            yield stamp, joint_state(stamp, *zip(*joints))
        if k % 10 == 0:
            yield stamp, joint_state(stamp, ["finger"], [0.0], [float("nan")])


folder = Path(sys.argv[1])
messages = list(states())
for name, compression in (("none", CompressionType.NONE), ("lz4", CompressionType.LZ4), ("zstd", CompressionType.ZSTD)):
    writer = Writer(str(folder / f"bag_{name}.mcap"), chunk_size=8192, compression=compression)
    writer.start(profile="ros2")
    schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
    channel = writer.register_channel("/joint_states", "cdr", schema)
    for stamp, data in messages:
        time = round(stamp * 1e9)
        writer.add_message(channel, log_time=time + 5_000_000, publish_time=time, data=data)
    writer.finish()
