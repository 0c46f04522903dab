"""Our recordings, read with the MCAP project's own Python packages, against candump's lines.

The files are written by our tests: `whole` and `repaired` hold every kind of frame, `cut` is what a
killed recorder leaves, `ring` is a file of the ring of a whole service and `kept` what it kept of it.
"""

import math
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import mcap.exceptions
import mcap.reader
import mcap.stream_reader
import mcap_ros2.decoder

ROOT = pathlib.Path(__file__).resolve().parents[2]
WRITE = "child_writes_files_for_an_independent_reader"
LINE = re.compile(r"\((\d+)\.(\d{9})\) (\S+) ([0-9A-F]+)#(#[0-9A-F])?(R\d?)?([0-9A-F]*)( [TR])?")


def frame_of_line(line):
    """A line of a candump log in the words of the schema."""
    seconds, fraction, interface, identifier, flags, remote, data, way = LINE.fullmatch(line).groups()
    number, flags = int(identifier, 16), int(flags[1], 16) if flags else 0
    error = len(identifier) == 8 and number >= 0x20000000
    data = bytes.fromhex(data)
    return {
        "time": int(seconds) * 10**9 + int(fraction),
        "topic": f"/can/{interface}",
        "id": number & 0x1FFFFFFF,
        "is_extended": len(identifier) == 8,
        "is_rtr": remote is not None,
        "is_error": error,
        "is_fd": "##" in line,
        "bit_rate_switch": bool(flags & 1),
        "error_state_indicator": bool(flags & 2),
        "is_transmitted": way == " T",
        "length": int(remote[1:] or 0) if remote else len(data),
        "data": data,
    }


def frame_of_message(channel, message, decoded):
    frame = {name: getattr(decoded, name) for name in decoded.__slots__}
    return frame | {"time": message.log_time, "topic": channel.topic, "data": bytes(decoded.data)}


def frames_of_file(path):
    """Through the summary and the indexes, as viewers do."""
    with path.open("rb") as file:
        reader = mcap.reader.make_reader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()], validate_crcs=True)
        messages = reader.iter_decoded_messages(log_time_order=False)
        messages = [entry for entry in messages if entry[1].topic != "/joint_states"]
        frames = [frame_of_message(channel, message, decoded) for _, channel, message, decoded in messages]
        count = reader.get_summary().statistics.message_count
    return frames, count


class Recordings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        # As tests/run builds it: of one package, or without the feature, much is built anew.
        cargo = ["cargo", "test", "--quiet", "--workspace", "--features", "parquet,sqlite,tls", "--locked", "--test", "tests"]
        cargo += ["--", "--ignored", WRITE]
        subprocess.run(cargo, cwd=ROOT, check=True, env=os.environ | {"DIDIM_RECORDINGS": cls.folder}, stdout=subprocess.DEVNULL)

    def lines(self, name):
        return [frame_of_line(line) for line in (self.folder / f"{name}.log").read_text().splitlines()]

    def test_a_whole_file_a_repaired_one_and_one_of_the_ring_hold_the_frames_of_the_log(self):
        for name in ["whole", "repaired", "ring"]:
            with self.subTest(name):
                frames, count = frames_of_file(self.folder / f"{name}.mcap")
                expected = self.lines(name)
                if name == "ring":
                    # The service names the interface of its bus, the log that of its own.
                    expected = [frame | {"topic": "/can/vcan0"} for frame in expected]
                self.assertGreater(count, 99)
                self.assertEqual((count, len(frames)), (len(expected), len(expected)))
                # Not in one comparison: its message would be the whole file.
                for k, (frame, other) in enumerate(zip(frames, expected)):
                    self.assertEqual(frame, other, f"frame {k}")

    def test_what_is_kept_is_a_part_of_the_ring(self):
        frames, count = frames_of_file(self.folder / "kept.mcap")
        ring, _ = frames_of_file(self.folder / "ring.mcap")
        begin = next(k for k, frame in enumerate(ring) if frame == frames[0])
        self.assertTrue(ring[begin : begin + len(frames)] == frames)
        with (self.folder / "kept.mcap").open("rb") as file:
            (metadata,) = mcap.reader.make_reader(file).iter_metadata()
        self.assertEqual(metadata.name, "didim")
        self.assertEqual((metadata.metadata["window"], metadata.metadata["interfaces"]), ("0", "vcan0"))

    def test_what_is_kept_has_the_curves_of_the_joints(self):
        frames, count = frames_of_file(self.folder / "kept.mcap")
        frame_at = {frame["time"]: frame for frame in frames}
        with (self.folder / "kept.mcap").open("rb") as file:
            reader = mcap.reader.make_reader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()], validate_crcs=True)
            states = list(reader.iter_decoded_messages(topics=["/joint_states"]))
        # One packed frame is one sample.
        self.assertEqual((len(states), count), (len(frames), 2 * len(frames)))
        for schema, _, message, state in states:
            self.assertEqual(schema.name, "sensor_msgs/msg/JointState")
            stamp = state.header.stamp
            self.assertEqual(stamp.sec * 10**9 + stamp.nanosec, message.log_time)
            self.assertIn(message.log_time, frame_at)
            self.assertEqual(list(state.name), [f"joint_{joint}" for joint in range(1, 7)])
            self.assertEqual([len(state.position), len(state.velocity), len(state.effort)], [6, 0, 6])
            # The motor of axis 1 turns by 196608 counts, 32 times a turn of its joint; that of axis 4 by 65536, -48 times.
            data = frame_at[message.log_time]["data"]
            for axis, counts in [(0, 196608 * 32), (3, 65536 * -48)]:
                raw = int.from_bytes(data[4 * axis : 4 * axis + 4], "little", signed=True)
                self.assertAlmostEqual(state.position[axis], math.tau * raw / counts, delta=1e-12)

    def test_a_file_without_an_end_gives_its_whole_chunks(self):
        with (self.folder / "cut.mcap.part").open("rb") as file:
            frames, decoder = [], None
            reader = mcap.reader.NonSeekingReader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
            with self.assertRaises((mcap.exceptions.EndOfFile, mcap.exceptions.McapError)):
                for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
                    frames.append(frame_of_message(channel, message, decoded))
        self.assertEqual(len(frames), len(self.lines("repaired")))
