#!/usr/bin/env python3
"""Files of further loggers, from a URDF to a report.

    loggers.py OUT PROGRAM [NUMBER ...]

Each function writes a recording of the arm of `make.py`, by the writer of another project or in
the layout that its documentation has, and returns the file with the options of `didim new`.
Needs: pip install asammdf rosbags polars pandas pyarrow npTDMS
"""

import datetime
import importlib.util
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd

SPEC = importlib.util.spec_from_file_location("make", Path(__file__).with_name("make.py"))
make = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(make)

AXES = range(1, 7)
JOINTS = [f"joint_{axis}" for axis in AXES]
LOGGERS = []
RUNS = {}


def logger(name, rate=250.0):
    def register(function):
        LOGGERS.append((name, rate, function))
        return function
    return register


class Run:
    """Times, positions and torques, as arrays."""

    def __init__(self, rate):
        run = make.record(make.arm(), rate=rate)
        self.t, self.q, self.v, self.torque = map(np.array, (run.t, run.q, run.v, run.torque))
        start = datetime.datetime(2026, 11, 3, 9)
        self.dates = [start + datetime.timedelta(seconds=float(t)) for t in self.t]

    def rows(self, degrees=False):
        positions = np.degrees(self.q) if degrees else self.q
        return zip(self.t, self.dates, positions, self.torque)


def fixed(values):
    return [f"{value:.6f}" for value in values]


def columns(position, torque):
    return [position.format(axis) for axis in AXES] + [torque.format(axis) for axis in AXES]


def table(attempt, name, lines, end="\r\n"):
    attempt.write(name, (end.join(lines) + end).encode())
    return name, ("--log", name)


@logger("asammdf 8, MDF 4 exported as CSV with units")
def log_mdf(attempt, run):
    from asammdf import MDF, Signal
    signals = []
    for axis in range(6):
        signals += [
            Signal(np.degrees(run.q[:, axis]), run.t, name=f"ActPos_{axis + 1}", unit="deg"),
            Signal(run.torque[:, axis], run.t, name=f"ActTorque_{axis + 1}", unit="Nm")]
    file = MDF(version="4.10")
    file.append(signals)
    file.export("csv", attempt.folder / "run.csv", add_units=True, overwrite=True,
                time_as_date=False)
    name = next(path.name for path in attempt.folder.glob("run*.csv"))
    return name, ("--log", name)


@logger("InfluxDB, annotated CSV with a pivot")
def log_influx(attempt, run):
    lines = [
        "#group,false,false,true,true,false" + ",false" * 12,
        "#datatype,string,long" + ",dateTime:RFC3339" * 3 + ",double" * 12,
        "#default,_result,,,," + "," * 12,
        ",result,table,_start,_stop,_time," + ",".join(columns("position_{}", "effort_{}"))]
    for _, date, q, torque in run.rows():
        lines.append(f",,0,2026-11-03T08:00:00Z,2026-11-03T10:00:00Z,{date.isoformat()}Z,"
                     + ",".join(fixed([*q, *torque])))
    return table(attempt, "run.csv", lines)


@logger("InfluxDB, annotated CSV with one value a row", rate=100.0)
def log_influx_long(attempt, run):
    lines = [
        "#datatype,string,long,dateTime:RFC3339,double,string",
        ",result,table,_time,_value,_field"]
    values = np.hstack([run.q, run.torque]).T
    for number, (name, series) in enumerate(zip(columns("position_{}", "effort_{}"), values)):
        lines += [f",,{number},{date.isoformat()}Z,{value:.6f},{name}"
                  for date, value in zip(run.dates, series)]
    return table(attempt, "run.csv", lines)


@logger("Grafana, CSV of a panel with units")
def log_grafana(attempt, run):
    lines = ['"Time",' + ",".join(f'"{name}"' for name in columns("position {}", "torque {}"))]
    for _, date, q, torque in run.rows(degrees=True):
        lines.append(f"{date:%Y-%m-%d %H:%M:%S}.{date.microsecond // 1000:03d},"
                     + ",".join([f"{x:.5f}°" for x in q] + [f"{x:.4f} N·m" for x in torque]))
    return table(attempt, "panel.csv", lines, end="\n")


@logger("LabVIEW, measurement file (.lvm)")
def log_lvm(attempt, run):
    def line(name, values):
        return "\t".join([name, *values]) + "\t"
    lines = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
        "Decimal_Separator\t.", "Multi_Headings\tNo", "X_Columns\tOne", "Time_Pref\tAbsolute",
        "Date\t2026/11/03", "Time\t09:00:00.123456", "***End_of_Header***\t", "\t" * 12,
        line("Channels", ["12"] + [""] * 11), line("Samples", [str(len(run.t))] * 12),
        line("Date", ["2026/11/03"] * 12), line("Y_Unit_Label", ["rad"] * 6 + ["Nm"] * 6),
        line("Delta_X", ["0.004000"] * 12), line("***End_of_Header***", [""] * 12),
        "\t".join(["X_Value", *columns("Position {}", "Torque {}"), "Comment"])]
    for t, _, q, torque in run.rows():
        lines.append("\t".join(fixed([t, *q, *torque])))
    return table(attempt, "run.lvm", lines)


@logger("CODESYS 2.3, trace in an ASCII file", rate=100.0)
def log_codesys(attempt, run):
    names = columns("PLC_PRG.Axis{}.ActPos", "PLC_PRG.Axis{}.ActTorque")
    lines = ["CoDeSys Trace", "D:\\PROJECTS\\ARM.PRO", " ".join(["Cycle", *names])]
    for t, _, q, torque in run.rows(degrees=True):
        lines.append(" ".join([f"{1000 * t:.0f}", *fixed([*q, *torque])]))
    return table(attempt, "trace.txt", lines)


@logger("R, `write.csv` with names of rows")
def log_r(attempt, run):
    lines = [",".join(f'"{name}"' for name in ["", "time", *columns("q.{}", "tau.{}")])]
    for number, (t, _, q, torque) in enumerate(run.rows(), 1):
        lines.append(f'"{number}",{t:.6g},' + ",".join(fixed([*q, *torque])))
    return table(attempt, "run.csv", lines, end="\n")


@logger("pandas, `to_csv` with two levels of columns")
def log_pandas(attempt, run):
    names = pd.MultiIndex.from_product([["position", "effort"], JOINTS])
    index = pd.Index(run.t, name="time")
    frame = pd.DataFrame(np.hstack([run.q, run.torque]), index=index, columns=names)
    frame.to_csv(attempt.folder / "run.csv")
    return "run.csv", ("--log", "run.csv")


@logger("polars, Parquet with dates")
def log_polars(attempt, run):
    import polars
    content = {"stamp": run.dates}
    for axis, name in enumerate(JOINTS):
        content[f"{name}_pos"] = run.q[:, axis]
        content[f"{name}_effort"] = run.torque[:, axis].astype("float32")
    polars.DataFrame(content).write_parquet(attempt.folder / "run.parquet")
    return "run.parquet", ("--log", "run.parquet")


@logger("rosbags, a bag of joint states (MCAP)", rate=200.0)
def log_rosbags(attempt, run):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore
    types = get_typestore(Stores.ROS2_HUMBLE)
    state = types.types["sensor_msgs/msg/JointState"]
    header = types.types["std_msgs/msg/Header"]
    time = types.types["builtin_interfaces/msg/Time"]
    shutil.rmtree(attempt.folder / "bag", ignore_errors=True)
    with Writer(attempt.folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", state.__msgtype__, typestore=types)
        for t, q, v, torque in zip(run.t, run.q, run.v, run.torque):
            ns = 1_762_000_000_000_000_000 + round(t * 1e9)
            stamp = header(stamp=time(sec=ns // 10**9, nanosec=ns % 10**9), frame_id="")
            message = state(header=stamp, name=JOINTS, position=q, velocity=v, effort=torque)
            writer.write(topic, ns, types.serialize_cdr(message, state.__msgtype__))
    return "bag", ("--bag", "bag")


@logger("Excel, German: semicolons and decimal commas")
def log_excel(attempt, run):
    names = columns("Istposition A{} [°]", "Istmoment A{} [Nm]")
    lines = ["\ufeff" + ";".join(["Zeit [ms]", *names])]
    for t, _, q, torque in run.rows(degrees=True):
        lines.append(";".join(fixed([1000 * t, *q, *torque])).replace(".", ","))
    return table(attempt, "run.csv", lines)


@logger("npTDMS, a TDMS file of LabVIEW")
def log_tdms(attempt, run):
    from nptdms import ChannelObject, TdmsWriter
    values = np.hstack([run.q, run.torque]).T
    with TdmsWriter(str(attempt.folder / "run.tdms")) as writer:
        writer.write_segment([
            ChannelObject("arm", name, series)
            for name, series in zip(columns("q{}", "tau{}"), values)])
    return "run.tdms", ("--log", "run.tdms")


@logger("pyarrow, Feather")
def log_feather(attempt, run):
    names = ["time", *columns("q{}", "tau{}")]
    frame = pd.DataFrame(np.column_stack([run.t, run.q, run.torque]), columns=names)
    frame.to_feather(attempt.folder / "run.feather")
    return "run.feather", ("--log", "run.feather")


def main(out, program, numbers):
    print(make.head("logger", "result"))
    for number, (name, rate, function) in enumerate(LOGGERS, 11):
        if numbers and str(number) not in numbers:
            continue
        if rate not in RUNS:
            RUNS[rate] = Run(rate)
        attempt = make.Attempt(out / f"logger-{number}", program)
        attempt.folder.mkdir(parents=True, exist_ok=True)
        attempt.write("arm.urdf", make.urdf(make.arm()))
        recording, options = function(attempt, RUNS[rate])
        for made in ("cell.toml", "report.html", "result.json"):
            (attempt.folder / made).unlink(missing_ok=True)
        attempt.run("new", "cell.toml", "--robot", "arm.urdf", *options,
                    "--set", "urdf.drive_inertia=true")
        attempt.identify(recording, "--report", "report.html")
        done = (attempt.folder / "report.html").is_file()
        text = make.is_true(attempt)[1] if done else make.answer(attempt)
        print(f"| {name} | {'report; ' if done else ''}{make.plain(text)} |", flush=True)
        attempt.write("answers.txt", f"{attempt.codes}\n{attempt.text}")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]).resolve(), str(Path(sys.argv[2]).resolve()), sys.argv[3:])
