"""Parquet files of one motion by two writers, and the same as text (pip install pyarrow polars).

    /tmp/venv-golden/bin/python crates/formats/tests/golden/parquet.py crates/formats/tests/golden

Two axes at 250 Hz, 120 rows: `t_ms` the time, `q_1`, `q_2`, `tau_0`, `tau_1`, and columns that nobody asks for.
"""

import datetime
import math
import sys
from pathlib import Path

import polars
import pyarrow
import pyarrow.parquet

ROWS = range(120)
FOLDER = Path(sys.argv[1])

# Steps repeat their values: dictionaries are then worth it.
motion = {
    "t_ms": [round(4.0 * k, 3) for k in ROWS],
    "q_1": [round(math.sin(0.11 * k), 6) for k in ROWS],
    "q_2": [round(math.cos(0.07 * k), 6) for k in ROWS],
    "tau_0": [float(k // 10 % 3 - 1) for k in ROWS],
    "tau_1": [round(math.sin(0.05 * k + 1), 4) for k in ROWS],
}
rest = {"mode": ["auto" if k % 2 else "manual" for k in ROWS], "pose": [[float(k), 0.0] for k in ROWS]}


def write(name, table, **options):
    pyarrow.parquet.write_table(table, FOLDER / f"parquet_{name}.parquet", **options)


lines = [",".join(motion)] + [",".join(map(repr, row)) for row in zip(*motion.values())]
(FOLDER / "parquet.csv").write_text("\n".join(lines) + "\n")

table = pyarrow.table(motion | rest)
for compression in ("none", "snappy", "gzip", "zstd", "lz4"):
    write(compression, table, compression=compression, row_group_size=50)
write("plain", table, use_dictionary=False, data_page_version="2.0", compression="none", write_statistics=False)
write("split", table, use_dictionary=False, use_byte_stream_split=list(motion), compression="zstd")
polars.DataFrame(motion | rest).write_parquet(FOLDER / "parquet_polars.parquet", row_group_size=40)

# Other types, of the columns that they are usual for.
float32 = [pyarrow.array(motion[name], pyarrow.float32()) for name in ("q_1", "q_2", "tau_1")]
counts = [round(value) for value in motion["tau_0"]]
begin = datetime.datetime(2026, 3, 1, tzinfo=datetime.timezone.utc)
stamps = [begin + datetime.timedelta(milliseconds=time) for time in motion["t_ms"]]


def typed(time, tau_0):
    arrays = [time, float32[0], float32[1], tau_0, float32[2]]
    # Required columns: without levels for nulls.
    fields = [pyarrow.field(n, a.type, nullable=False) for n, a in zip(motion, arrays)]
    return pyarrow.table(arrays, schema=pyarrow.schema(fields))


for unit in ("ms", "us", "ns"):
    time = pyarrow.array(stamps, pyarrow.timestamp(unit, "UTC"))
    write(f"stamps_{unit}", typed(time, pyarrow.array(counts, pyarrow.int8())))
write("int96", typed(time, pyarrow.array(counts)), use_deprecated_int96_timestamps=True)
seconds = pyarrow.array([int(time) for time in motion["t_ms"]], pyarrow.uint32())
write("unsigned", typed(seconds, pyarrow.array([count + 2**32 - 5 for count in counts], pyarrow.uint32())))
longer = pyarrow.array([count + 2**63 for count in counts], pyarrow.uint64())
write("unsigned_64", typed(seconds, longer))

# A column of each kind that is no number, and two with holes.
other = motion | {"tau_0": [None if k == 77 else v for k, v in enumerate(motion["tau_0"])]}
other["tau_1"] = [math.nan if k == 99 else v for k, v in enumerate(motion["tau_1"])]
other |= {"flag": [k % 2 == 0 for k in ROWS], "day": [begin.date()] * len(ROWS), **rest}
other["pair"] = [{"a": 1.0, "b": 2.0}] * len(ROWS)
other = pyarrow.table(other).append_column("half", pyarrow.array(motion["q_1"], pyarrow.float16()))
money = pyarrow.array(["1.50"] * len(ROWS)).cast(pyarrow.decimal128(7, 2))
write("other", other.append_column("money", money), row_group_size=50)

own = {"time_s": [round(0.004 * k, 3) for k in ROWS]}
own |= {"joint_position_rad_1": motion["q_1"], "joint_torque_nm_1": motion["tau_1"]}
polars.DataFrame(own).write_parquet(FOLDER / "parquet_own.parquet", compression="snappy")
