"""Decodes a candump log to an experiment in SI units, without any of our own code.

    python decode.py CELL.toml LOG OUT.csv

python-can reads the log, cantools the frames. What remains is written from the standards, not from
our sources: CiA 301 (the cycle between two SYNCs, targets that take effect at the next one) and
CiA 402 (the state in the status word).
"""

import csv
import math
import pathlib
import sys
import tomllib

import can
import cantools

import nodes


def position_rad(gain, value, bits):
    """sign * scale * (value - zero) [rad], modulo the range of the integer where the cell says so."""
    (kind, number), = gain["scale"].items() if isinstance(gain["scale"], dict) else [("rad", 1.0)]
    scale = {
        "counts_per_revolution": lambda: 2.0 * math.pi / number,
        "rad_per_count": lambda: number,
        "rad": lambda: 1.0,
    }[kind]()
    difference = value - gain["zero"]
    if gain["wraps"] == "modulo":
        span = 2.0**bits
        difference = (difference + span / 2.0) % span - span / 2.0
    return gain["sign"] * scale * difference


def torque_nm(gain, value):
    """sign * scale * value [N m]."""
    (kind, number), = gain["scale"].items() if isinstance(gain["scale"], dict) else [("nm", 1.0)]
    if kind == "per_mille_of_rated_torque":
        scale = number["rated_torque_nm"] / 1000.0
    elif kind == "per_mille_of_rated_current":
        # The current in the kind (effective value or amplitude) that the torque constant is for.
        amplitude = {"rms": math.sqrt(2.0), "peak": 1.0}
        current = number["rated_current_a"] * amplitude[number["current_is"]]
        current /= amplitude[number["torque_constant_is"]]
        scale = current * number["torque_constant_nm_per_a"] / 1000.0
    else:
        scale = {"nm_per_count": number, "nm": 1.0}[kind]
    return gain["sign"] * scale * value


def knows(cell_file):
    """Whether the cell's frames are of CAN, and all its signals of one instant of each cycle."""
    layout = tomllib.loads(pathlib.Path(cell_file).read_text())["bus"]["layout"]
    return "slaves" not in layout and layout["position"]["valid"] == "instant"


class Bus:
    """The frames of one cell: what `[bus.layout]` and `[[bus.drives]]` say."""

    def __init__(self, cell_file):
        cell_file = pathlib.Path(cell_file)
        bus = tomllib.loads(cell_file.read_text())["bus"]
        self.layout, self.drives = bus["layout"], bus["drives"]
        if "nodes" in self.layout:
            self.database = nodes.Database(self.layout, cell_file.parent)
            for key in ["position", "torque", "reference"]:
                self.layout[key]["signal"] = self.layout[key]["object"]
            self.layout["sync"] = "SYNC"
        else:
            self.database = cantools.database.load_file(cell_file.parent / self.layout["dbc"])
        self.axes = range(1, self.layout["axes"] + 1)

    def names(self, signal):
        """(message, signal) of every axis."""
        if "nodes" in self.layout:
            ids = [node["node_id"] for node in self.layout["nodes"]]
            return [(self.database.find(node_id, signal), signal) for node_id in ids]
        return [signal.replace("{axis}", str(axis)).split(".") for axis in self.axes]

    def read(self, values, signal):
        """The value of every axis with the length of its integer, or None where one is missing."""
        out = []
        for message, name in self.names(signal):
            if message not in values:
                return None
            bits = self.database.get_message_by_name(message).get_signal_by_name(name).length
            out.append((values[message][name], bits))
        return out

    def cycles(self, log):
        """(time, {message: {signal: value}}) of every bus cycle."""
        sync, stamp, values = self.layout.get("sync"), None, {}
        known = {message.frame_id: message for message in self.database.messages}
        for frame in can.CanutilsLogReader(log):
            message = known.get(frame.arbitration_id)
            if message is None or frame.is_error_frame or frame.is_remote_frame:
                continue
            if sync is None:
                yield frame.timestamp, {message.name: message.decode(frame.data, decode_choices=False)}
            elif message.name == sync:
                if stamp is not None:
                    yield stamp, values
                stamp, values = frame.timestamp, {}
            elif stamp is not None:
                values[message.name] = message.decode(frame.data, decode_choices=False)
        if stamp is not None and values:
            yield stamp, values

    def enabled(self, values):
        """Whether every drive is in the state `operation enabled` (CiA 402: x01x 0111)."""
        words = self.read(values, self.layout["status_word"])
        return words is not None and all(int(word) & 0x6F == 0x27 for word, _ in words)

    def samples(self, log):
        """[time, positions, torques, references] of every cycle in which nothing is missing."""
        layout, pending = self.layout, None
        for stamp, values in self.cycles(log):
            positions = self.read(values, layout["position"]["signal"])
            torques = self.read(values, layout["torque"]["signal"])
            references = []
            if "reference" in layout:
                references = self.read(values, layout["reference"]["signal"])
                if layout["reference"]["valid"] == "next-sync":
                    references, pending = pending, references
            if None in (positions, torques, references):
                continue
            if "status_word" in layout and not self.enabled(values):
                continue
            gains = self.drives
            yield [
                stamp,
                *(position_rad(g["position"], *value) for g, value in zip(gains, positions)),
                *(torque_nm(g["torque"], value) for g, (value, _) in zip(gains, torques)),
                *(position_rad(g["position"], *value) for g, value in zip(gains, references)),
            ]

    def header(self):
        """The columns of `samples`."""
        quantities = ["position_rad", "torque_nm"] + ["reference_rad"] * ("reference" in self.layout)
        return ["time_s"] + [f"motor_{name}_{axis}" for name in quantities for axis in self.axes]


def main(cell_file, log, out):
    bus = Bus(cell_file)
    with open(out, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(bus.header())
        writer.writerows(bus.samples(log))


if __name__ == "__main__":
    main(*sys.argv[1:])
