"""Writes layout.csv: random frames and what cantools reads from them.

    python3 -m venv VENV && VENV/bin/pip install cantools==39.4.13
    VENV/bin/python layout.py > layout.csv

`layout.py --check` compares the committed file with what the installed cantools says and exits 1 at
a difference. Every line is `dbc,message,payload in hexadecimal,signal,value`; a value is the
IEEE 754 binary64 number in hexadecimal, so nothing is rounded.
"""

import io
import math
import pathlib
import random
import struct
import sys

import cantools

HERE = pathlib.Path(__file__).resolve().parent
SHIPPED = HERE.parents[2] / "config" / "dbc"
FILES = {
    "cia402": (SHIPPED / "cia402_six_axes.dbc", 6),
    "packed": (SHIPPED / "packed_fd_six_axes.dbc", 10),
    "odd": (HERE / "odd.dbc", 30),
}


def payloads(rng, length, count):
    """All zeros, all ones, and random bytes."""
    yield bytes(length)
    yield b"\xff" * length
    for _ in range(count):
        yield rng.randbytes(length)


def write(out):
    rng = random.Random(402)
    for name, (path, count) in FILES.items():
        database = cantools.database.load_file(path)
        for message in sorted(database.messages, key=lambda message: message.frame_id):
            for payload in payloads(rng, message.length, count):
                values = message.decode(payload, decode_choices=False)
                for signal in sorted(values):
                    value = float(values[signal])
                    # The bits of a NaN are not compared.
                    text = "nan" if math.isnan(value) else struct.pack(">d", value).hex()
                    out.write(f"{name},{message.name},{payload.hex()},{signal},{text}\n")


def main():
    text = io.StringIO()
    write(text)
    if sys.argv[1:] == ["--check"]:
        sys.exit(text.getvalue() != (HERE / "layout.csv").read_text())
    sys.stdout.write(text.getvalue())


main()
