"""The same frames in logs of several tools, by python-can (pip install python-can).

    /tmp/venv-golden/bin/python drivers/tests/golden/logs.py drivers/tests/golden

Classic frames of 11 and 29 bits, of all lengths and both directions, a remote request and an error frame; CAN FD frames
with and without switch of the bit rate. TRC files hold the classic ones: the library writes no others.
"""

import random
import sys
from pathlib import Path

import can
from can.io import ASCWriter, BLFWriter, CanutilsLogWriter, TRCWriter
from can.io.trc import TRCFileVersion

random.seed(11)
LENGTHS = [0, 1, 2, 3, 4, 5, 6, 7, 8]
FD_LENGTHS = [0, 8, 12, 16, 20, 24, 32, 48, 64]


def message(k, **more):
    return can.Message(timestamp=1000.0 + k / 1000, channel=1, **more)


def data(length):
    return [random.randrange(256) for _ in range(length)]


def classic():
    k = 0
    for extended in (False, True):
        for length in LENGTHS:
            identifier = random.randrange(1 << (29 if extended else 11))
            yield message(k, arbitration_id=identifier, is_extended_id=extended, data=data(length), is_rx=k % 3 > 0)
            k += 1


def further():
    yield message(18, arbitration_id=0x123, is_extended_id=False, is_remote_frame=True, dlc=4)
    yield message(19, is_error_frame=True)
    for k, length in enumerate(FD_LENGTHS, 20):
        yield message(k, arbitration_id=0x200 + k, is_extended_id=k % 2 > 0, is_fd=True, bitrate_switch=k % 3 > 0, data=data(length))


def write(writer, messages):
    for one in messages:
        writer.on_message_received(one)
    writer.stop()


folder = Path(sys.argv[1])
frames = list(classic())
write(CanutilsLogWriter(folder / "classic.log"), frames)
write(ASCWriter(folder / "classic.asc"), frames)
for version in (TRCFileVersion.V1_0, TRCFileVersion.V2_1):
    writer = TRCWriter(folder / f"classic_{version.name.lower()}.trc")
    writer.file_version = version
    write(writer, frames)
frames += list(further())
write(CanutilsLogWriter(folder / "all.log"), frames)
write(ASCWriter(folder / "all.asc"), frames)
write(BLFWriter(folder / "all.blf"), frames)
# Small containers: frames continue in the next one.
write(BLFWriter(folder / "small.blf", max_container_size=100), frames)
