"""Our tools against the independent decoder, and the independent decoder against bytes by hand."""

import json
import math
import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import tomllib
import unittest
import urllib.request

import jsonschema
import numpy as np
import prometheus_client.parser

import compare
import decode
from recordings import Recordings as Recordings

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "docs" / "guide"))
import results

AXES = range(1, 7)
ENABLED, SWITCHED_ON = 0x0637, 0x0633

# What the two DBC files of config/ need in a cell; a drive's gains follow per axis.
CIA402 = """[bus.layout]
dbc = "{root}/config/dbc/cia402_six_axes.dbc"
axes = 6
sync = "SYNC"
position = {{ signal = "TPDO1_{{axis}}.PositionActualValue", valid = "instant" }}
torque = {{ signal = "TPDO1_{{axis}}.TorqueDemand", valid = "instant" }}
reference = {{ signal = "RPDO1_{{axis}}.TargetPosition", valid = "next-sync" }}
status_word = "TPDO1_{{axis}}.StatusWord"
"""
PACKED = """[bus.layout]
dbc = "{root}/config/dbc/packed_fd_six_axes.dbc"
axes = 6
position = {{ signal = "Sample.Position_{{axis}}", valid = "instant" }}
torque = {{ signal = "Sample.Torque_{{axis}}", valid = "instant" }}
reference = {{ signal = "Sample.Reference_{{axis}}", valid = "instant" }}
counter = "Sample.Counter"
"""
DRIVE = """[[bus.drives]]
position = {{ scale = {{ counts_per_revolution = 65536.0 }}, sign = {sign}, zero = 100.0, wraps = "refuse" }}
torque = {{ scale = {{ per_mille_of_rated_torque = {{ rated_torque_nm = 2.0 }} }}, sign = {sign} }}
"""


def pdo(word, position, torque):
    return struct.pack("<Hih", word, position, torque).hex()


def cycle(stamp, number, word=ENABLED):
    """The frames of CiA 402 cycle `number`, as text."""
    lines = [f"({stamp:.6f}) vcan0 080#"]
    for axis in AXES:
        at = number * 1000 + axis
        lines.append(f"({stamp + 1e-4:.6f}) vcan0 {0x180 + axis:03X}#{pdo(word, at, -at % 900)}")
        lines.append(f"({stamp + 2e-4:.6f}) vcan0 {0x200 + axis:03X}#{pdo(0xF, at + 7, 0)}")
    return lines


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def bus(self, layout):
        """The decoder for a cell whose second drive turns against the robot file."""
        cell = self.folder / "cell.toml"
        drives = "".join(DRIVE.format(sign=-1 if axis == 2 else 1) for axis in AXES)
        cell.write_text(layout.format(root=ROOT) + drives)
        return decode.Bus(cell)

    def samples(self, layout, lines):
        log = self.folder / "bus.log"
        log.write_text("".join(line + "\n" for line in lines))
        return list(self.bus(layout).samples(log))


class TheDecoder(Folder):
    """By hand: bytes by struct, and the values that they stand for."""

    def test_synchronous_pdos(self):
        lines = [line for k in range(4) for line in cycle(10.0 + 0.002 * k, k)]
        samples = self.samples(CIA402, lines)
        # The first cycle has no reference yet: its targets take effect at the second SYNC.
        self.assertEqual([round(sample[0], 6) for sample in samples], [10.002, 10.004, 10.006])
        for k, (_, *values) in enumerate(samples, start=1):
            for axis in AXES:
                sign, at = (-1 if axis == 2 else 1), k * 1000 + axis
                position, torque, reference = values[axis - 1 :: 6]
                rad = sign * 2.0 * math.pi / 65536.0
                self.assertAlmostEqual(position, rad * (at - 100), delta=1e-13)
                self.assertAlmostEqual(torque, sign * 0.002 * (-at % 900), delta=1e-13)
                self.assertAlmostEqual(reference, rad * (at - 1000 + 7 - 100), delta=1e-13)

    def test_cycles_that_are_not_whole_are_left_out(self):
        lines = [line for k in range(6) for line in cycle(0.002 * k, k, SWITCHED_ON if k == 2 else ENABLED)]
        lines = [line for line in lines if not line.startswith("(0.008100) vcan0 183")]
        stamps = [round(sample[0], 6) for sample in self.samples(CIA402, lines)]
        self.assertEqual(stamps, [0.002, 0.006, 0.01])

    def test_a_packed_frame(self):
        payload = struct.pack("<6i6h6iI", *range(-3, 3), *range(-300, 300, 100), *range(6), 9)
        ((stamp, *values),) = self.samples(PACKED, [f"(5.000000) vcan0 100##1{payload.hex()}"])
        self.assertEqual((stamp, len(values)), (5.0, 18))
        self.assertAlmostEqual(values[1], 2.0 * math.pi / 65536.0 * 102, delta=1e-13)
        self.assertAlmostEqual(values[6], -0.6, delta=1e-13)
        self.assertAlmostEqual(values[17], 2.0 * math.pi / 65536.0 * -95, delta=1e-13)

    def test_gains(self):
        gain = {"scale": {"rad_per_count": 0.5}, "sign": -1, "zero": 250.0, "wraps": "modulo"}
        self.assertEqual(decode.position_rad(gain, 4, 8), -5.0)
        current = {"rated_current_a": 3.0, "current_is": "rms", "torque_constant_nm_per_a": 0.2}
        scale = {"per_mille_of_rated_current": current | {"torque_constant_is": "peak"}}
        # 500 per mille of 3 A effective are 1.5 * sqrt(2) A of amplitude.
        torque = decode.torque_nm({"scale": scale, "sign": 1}, 500)
        self.assertAlmostEqual(torque, 0.3 * math.sqrt(2.0), delta=1e-15)


class TheComparison(unittest.TestCase):
    """A comparison that cannot fail would prove nothing."""

    def setUp(self):
        rng = random.Random(1)
        names = ["motor_position_rad_1", "motor_position_rad_2", "motor_torque_nm_1"]
        self.theirs = {"time_s": [100.0 + 0.002 * row for row in range(50)]}
        self.theirs |= {name: [rng.uniform(-1.0, 1.0) for _ in range(50)] for name in names}

    def problems(self, change=lambda ours: None, rows=slice(1, 49)):
        ours = {name: list(values[rows]) for name, values in self.theirs.items()}
        ours["time_s"] = [time - ours["time_s"][0] for time in ours["time_s"]]
        change(ours)
        return compare.compare(self.theirs, ours, 1e-12, 1e-12)

    def test_what_agrees_agrees(self):
        for rows in [slice(0, 50), slice(1, 49), slice(2, 50), slice(0, 48)]:
            self.assertEqual(self.problems(rows=rows), [])

    def test_what_differs_is_found(self):
        position, other = "motor_position_rad_1", "motor_position_rad_2"
        changes = {
            "gain": lambda ours: ours.update({position: [x * 1.001 for x in ours[position]]}),
            "one value": lambda ours: ours["motor_torque_nm_1"].__setitem__(20, 9.0),
            "not a number": lambda ours: ours[position].__setitem__(20, math.nan),
            "axes": lambda ours: ours.update({position: ours[other], other: ours[position]}),
            "one sample late": lambda ours: ours[position].insert(0, ours[position].pop()),
            "a row lost": lambda ours: [values.pop(20) for values in ours.values()],
            "time": lambda ours: ours.update(time_s=[1.01 * t for t in ours["time_s"]]),
            "a column": lambda ours: ours.pop(other),
        }
        for what, change in changes.items():
            with self.subTest(what):
                self.assertNotEqual(self.problems(change), [])

    def test_missing_rows_are_found(self):
        self.assertNotEqual(self.problems(rows=slice(3, 50)), [])
        self.assertNotEqual(self.problems(rows=slice(0, 47)), [])


class OurTools(Folder):
    """`didim convert` in both directions, for every cell that is shipped but for those whose signals have instants of
    their own or come in EtherCAT's datagrams: drivers/tests/can_arms.rs and drivers/tests/ethercat.rs hold these to logs and
    captures that other programs have made of known motions."""

    def setUp(self):
        super().setUp()
        self.didim = os.environ["DIDIM_PROGRAM"]
        cells = sorted((ROOT / "config" / "cells").glob("*.toml"))
        self.cells = [cell for cell in cells if decode.knows(cell)]
        self.assertEqual(len(cells) - len(self.cells), 3)

    def convert(self, *arguments):
        run = subprocess.run([self.didim, "convert", *map(str, arguments)], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)

    def experiment(self, bus):
        """A smooth motion at the cell's rate, as CSV."""
        rate = bus.layout.get("rate_hz") or 1e6 / bus.layout["period_us"]
        path = self.folder / "experiment.csv"
        lines = [",".join(bus.header())]
        for row in range(300):
            t = row / rate
            angles = [math.sin((3.0 + axis) * t) for axis in bus.axes]
            torques = [0.2 * math.cos((5.0 + axis) * t) for axis in bus.axes]
            values = [t, *angles, *torques] + angles * ("reference" in bus.layout)
            lines.append(",".join(map(repr, values)))
        path.write_text("\n".join(lines) + "\n")
        return path

    def test_convert_agrees(self):
        self.assertTrue(self.cells)
        for cell in self.cells:
            with self.subTest(cell.name):
                bus = decode.Bus(cell)
                experiment, log, back = self.experiment(bus), self.folder / "bus.log", self.folder / "back.csv"
                self.convert("--cell", cell, experiment, log)
                theirs = self.folder / "theirs.csv"
                decode.main(cell, log, theirs)
                # CSV to log: both round to the nearest count.
                half = [max(abs(f(drive)) for drive in bus.drives) / 2.0 * 1.000001 for f in (one_count_rad, one_count_nm)]
                self.assertEqual(compare.compare(compare.read(experiment), compare.read(theirs), *half), [])
                # Log to CSV: the same counts, so only the arithmetic's last digits may differ.
                self.convert("--cell", cell, log, back)
                self.assertEqual(compare.compare(compare.read(theirs), compare.read(back), 1e-12, 1e-12), [])


def one_count_rad(drive):
    gain = drive["position"] | {"zero": 0.0, "wraps": "refuse"}
    return decode.position_rad(gain, 1, 32)


def one_count_nm(drive):
    return decode.torque_nm(drive["torque"], 1)


class TheMetrics(unittest.TestCase):
    """`didim metrics` read by the parser of Prometheus's own Python client."""

    def scrape(self, folder):
        command = [os.environ["DIDIM_PROGRAM"], "metrics", "--runtime", folder, "--listen", "127.0.0.1:0"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            try:
                url = next(word for line in process.stderr for word in line.split() if "http://" in word)
                with urllib.request.urlopen(url, timeout=30) as answer:
                    self.assertTrue(answer.headers["Content-Type"].startswith("text/plain; version=0.0.4"))
                    text = answer.read().decode()
            finally:
                process.terminate()
        families = list(prometheus_client.parser.text_string_to_metric_families(text))
        self.assertEqual(len(families), len({family.name for family in families}))
        for family in families:
            self.assertTrue(family.documentation and family.type != "unknown", family.name)
        return {(s.name, *sorted(s.labels.items())): s.value for f in families for s in f.samples}

    def test_a_service_that_is_away(self):
        with tempfile.TemporaryDirectory(dir="/tmp") as folder:
            self.assertEqual(self.scrape(folder)[("didim_up",)], 0.0)

    def test_a_service_that_answers(self):
        status = (ROOT / "crates" / "cli" / "tests" / "metrics" / "status.json").read_bytes()
        with tempfile.TemporaryDirectory(dir="/tmp") as folder, socket.socket(socket.AF_UNIX) as listener:
            listener.bind(f"{folder}/status.sock")
            listener.listen()

            def answer():
                client, _ = listener.accept()
                with client:
                    client.sendall(status)

            thread = threading.Thread(target=answer, daemon=True)
            thread.start()
            samples = self.scrape(folder)
            thread.join(30)
        status = json.loads(status)
        self.assertEqual(samples[("didim_up",)], 1.0)
        for cause, count in status["acquisition"]["frames_unused"].items():
            self.assertEqual(samples[("didim_frames_unused_total", ("cause", cause))], count)
        for value in status["estimation"]["last_estimate"]["parameters"]:
            labels = [("method", "idim-ls"), ("parameter", value["name"])]
            # In the order of their names.
            if "description" in value:
                labels.insert(0, ("description", value["description"]))
            self.assertEqual(samples[("didim_estimate_parameter", *labels)], value["value"])
        p99 = samples[("didim_frame_to_buffer_seconds", ("quantile", "0.99"))]
        self.assertAlmostEqual(p99, 1e-9 * status["acquisition"]["frame_to_buffer"]["p99_ns"], delta=1e-15)


class TheSchemas(Folder):
    """An independent validator accepts the shipped files and refuses a key that does not exist."""

    def setUp(self):
        super().setUp()
        program = os.environ["DIDIM_PROGRAM"]
        subprocess.run([program, "manual", "--out", self.folder / "manual"], check=True)

    def check(self, kind, table):
        text = (self.folder / "manual" / "schema" / f"didim-{kind}.schema.json").read_text()
        validator = jsonschema.Draft202012Validator(json.loads(text))
        validator.check_schema(validator.schema)
        files = sorted((ROOT / "config" / f"{kind}s").glob("*.toml"))
        self.assertGreater(len(files), 5)
        for file in files:
            content = tomllib.loads(file.read_text())
            validator.validate(content)
            content[table]["no_such_key"] = 1
            self.assertFalse(validator.is_valid(content), file)

    def test_cells(self):
        self.check("cell", "identification")

    def test_robots(self):
        self.check("robot", "transmission")


class TheExampleInPandas(unittest.TestCase):
    """docs/guide/results.py on what the program writes."""

    def identified(self):
        recordings = ROOT / "tests" / "data" / "kr300"
        command = [os.environ["DIDIM_PROGRAM"], "identify", "--json", "--cell", recordings / "cell.toml"]
        for name in ["a", "b"]:
            command += ["--input", recordings / f"{name}.csv"]
        run = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def test_a_result(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "result.json"
            file.write_text(self.identified())
            estimate = results.read_estimate(file)
            printed = self.printed(file)
        table, matrix = results.parameters(estimate), results.covariance(estimate)
        sigma = table["standard_deviation"].to_numpy()
        np.testing.assert_allclose(np.sqrt(np.diag(matrix)), sigma, rtol=1e-9)
        self.assertGreater(np.linalg.eigvalsh(matrix / np.outer(sigma, sigma)).min(), 0.0)
        worst = results.correlations(matrix)
        self.assertEqual(len(worst), len(table) * (len(table) - 1) // 2)
        self.assertTrue(worst["correlation"].abs().between(0.0, 1.0).all())
        self.assertIn(f"{worst.loc[0, 'first']} ", printed)

    def test_a_history(self):
        state = ROOT / "tests" / "data" / "stored" / "state"
        history = results.read_history(state / "history.jsonl")
        (result,) = state.glob("result-*.json")
        table = results.parameters(results.read_estimate(result))
        self.assertEqual(history["value"].to_list(), table["value"].to_list())
        self.assertTrue(history["good"].all())
        self.assertIn("2026-11-22 16:27:03", self.printed(result, state / "history.jsonl"))

    def printed(self, *files):
        run = subprocess.run([sys.executable, "-B", results.__file__, *files], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout


class TheGoldenFile(unittest.TestCase):
    """The golden values of the layout's own tests are what cantools still says."""

    def test_layout(self):
        script = ROOT / "drivers" / "tests" / "golden" / "layout.py"
        run = subprocess.run([sys.executable, "-B", script, "--check"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)


def main():
    suite = unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])
    result = unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(suite)
    for test, reason in result.skipped:
        print(f"test {test.id()} ... ignored, {reason}")
    failed = len({test.id().split(" (")[0] for test, _ in result.failures + result.errors})
    passed = result.testsRun - failed - len(result.skipped)
    print(f"test result: {passed} passed; {failed} failed; {len(result.skipped)} ignored")
    sys.exit(failed != 0)


if __name__ == "__main__":
    main()
