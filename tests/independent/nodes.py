"""The layout of a cell that names device files (EDS, DCF), read by the Python package `canopen`.

Looks like the database of `cantools` to `decode.Bus`: messages with their identifiers, and decoded
signals named after their objects.
"""

import canopen
from canopen.objectdictionary import datatypes

# First communication and mapping objects of TPDOs and RPDOs (CiA 301).
FIRST = {"TPDO": (0x1800, 0x1A00), "RPDO": (0x1400, 0x1600)}


class Signal:
    def __init__(self, start, length, signed):
        self.start, self.length, self.signed = start, length, signed


class Message:
    def __init__(self, name, frame_id):
        self.name, self.frame_id, self.signals = name, frame_id, {}

    def decode(self, data, decode_choices=False):
        word, values = int.from_bytes(data, "little"), {}
        for name, signal in self.signals.items():
            value = word >> signal.start & (1 << signal.length) - 1
            if signal.signed and value >> signal.length - 1:
                value -= 1 << signal.length
            values[name] = value
        return values

    def get_signal_by_name(self, name):
        return self.signals[name]


def value(variable):
    """What the drive was configured to, else what it has after a reset."""
    return variable.default if variable.value is None else variable.value


class Database:
    def __init__(self, layout, folder):
        self.messages, sync = [], set()
        for node in layout["nodes"]:
            path = folder / node.get("dcf", node.get("eds"))
            dictionary = canopen.import_od(str(path), node["node_id"])
            sync.add(value(dictionary[0x1005]) & 0x7FF)
            for kind in FIRST:
                self.messages += self.pdos(dictionary, node["node_id"], kind)
        (identifier,) = sync
        self.messages.append(Message("SYNC", identifier))

    @staticmethod
    def pdos(dictionary, node_id, kind):
        for number in range(512):
            communication, mapping = (first + number for first in FIRST[kind])
            if mapping not in dictionary:
                continue
            cob_id = value(dictionary[communication][1])
            message, start = Message(f"{kind}{number + 1} of {node_id}", cob_id & 0x1FFFFFFF), 0
            for entry in range(1, value(dictionary[mapping][0]) + 1):
                word = value(dictionary[mapping][entry])
                index, sub, length = word >> 16, word >> 8 & 0xFF, word & 0xFF
                kinds = dictionary[index].data_type if sub == 0 else dictionary[index][sub].data_type
                signed = kinds in datatypes.SIGNED_TYPES
                message.signals[f"{index:04X}:{sub:02X}"] = Signal(start, length, signed)
                start += length
            yield message

    def get_message_by_name(self, name):
        return next(message for message in self.messages if message.name == name)

    def find(self, node_id, name):
        """The message of a node that carries an object: targets are received, all else is sent."""
        of_node = [m for m in self.messages if m.name.endswith(f" of {node_id}") and name in m.signals]
        return of_node[0].name
