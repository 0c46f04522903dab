"""Identification from arrays: the values of the simulated arm, and those of the command line."""

from __future__ import annotations

import gc
import inspect
import json
import logging
import signal
import subprocess
import sys
import threading
import time as clock
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import didim
from conftest import ROOT, motion, recording, truth

KR300 = ROOT / "tests/data/kr300"


@pytest.fixture(scope="module")
def result(robot: didim.Robot) -> didim.Result:
    return didim.identify(robot, didim.Recording(*recording(robot, 1)), position_filter={"cutoff_hz": 10.0})


def test_parameters_of_the_simulated_arm_lie_within_their_uncertainty(
    robot: didim.Robot, result: didim.Result
) -> None:
    base = robot.to_base(truth(robot))
    names = [parameter.name for parameter in robot.base_parameters()]
    assert result.parameters.names == names
    assert all(unit for unit in result.parameters.units)
    deviations = (result.parameters.values - base) / result.parameters.combined_standard_deviations
    assert np.all(np.abs(deviations) < 4.0), dict(zip(names, deviations))
    assert np.all(result.parameters.standard_deviations <= result.parameters.combined_standard_deviations * 1.001)
    covariance = result.covariance
    assert covariance is not None and covariance.shape == (len(names), len(names))
    assert np.allclose(np.sqrt(np.diag(covariance)), result.parameters.standard_deviations, rtol=1e-9)
    assert result.parameters["fc1"].unit == "N·m"
    with pytest.raises(KeyError):
        result.parameters["nothing"]


def test_a_result_predicts_another_recording_as_it_expects(robot: didim.Robot, result: didim.Result) -> None:
    assert result.verdict.prediction.usable is True, result.verdict.prediction.reasons
    other = didim.Recording(*recording(robot, 2))
    prediction = result.predict(other)
    assert prediction.measured.shape == prediction.predicted.shape == (len(prediction.time), 2)
    error = np.linalg.norm(prediction.measured - prediction.predicted) / np.linalg.norm(prediction.measured)
    assert error == pytest.approx(prediction.relative_error, rel=1e-9)
    assert prediction.expected_error is not None
    assert 0.5 < prediction.relative_error / prediction.expected_error < 2.0


def test_several_recordings_give_one_result(robot: didim.Robot) -> None:
    recordings = [didim.Recording(*recording(robot, seed)) for seed in (1, 2)]
    both = didim.identify(robot, recordings, position_filter={"cutoff_hz": 10.0})
    assert len(both.data["relative_error_per_recording"]) == 2
    with pytest.raises(didim.UsageError, match="at least one recording"):
        didim.identify(robot, [])


def test_json_is_that_of_the_command_line() -> None:
    cell = didim.Cell.read(KR300 / "cell.toml")
    data = didim.read(KR300 / "a.csv", cell)
    result = didim.identify(cell, data, start=1.8, end=8.2)
    printed = didim.run("identify", cell=KR300 / "cell.toml", input=KR300 / "a.csv", from_=1.8, to=8.2, json=True)
    of_program = json.loads(printed)
    # Byte for byte: each key as the program prints it.
    for key, value in json.loads(result._native.json()).items():
        assert json.dumps(value) == json.dumps(of_program[key]), key
    prediction = result.predict(didim.read(KR300 / "b.csv", cell), start=0.5, end=8.5)
    assert 0.0 < prediction.relative_error < 0.5


def test_joints_choose_torques_as_on_the_command_line() -> None:
    cell = didim.Cell.read(KR300 / "cell.toml")
    found = didim.identify(cell, didim.read(KR300 / "a.csv", cell), start=1.8, end=8.2, joints=[1, 2, 3])
    line = {"cell": KR300 / "cell.toml", "input": KR300 / "a.csv", "json": True, "joints": "1,2,3"}
    printed = json.loads(didim.run("identify", from_=1.8, to=8.2, **line))
    assert json.dumps(found.data["parameters"]) == json.dumps(printed["parameters"])
    load = didim.payload(found, KR300 / "c.csv", start=1.8, end=8.196)
    assert len(load.data["after"]["relative_error_per_joint"]) == len(printed["relative_error_per_joint"])


def test_saved_results_are_read_by_the_program(result: didim.Result, tmp_path: Path) -> None:
    saved, report = tmp_path / "result.json", tmp_path / "report.html"
    result.save(saved)
    result.report(report)
    assert report.read_text().startswith("<!DOCTYPE html>")
    # The option takes two values, the files.
    differences = json.loads(didim.run("history --json --compare", saved, saved))["difference"]
    assert {of["difference"] for of in differences["parameters"]} == {0.0}


def test_a_model_is_exported(result: didim.Result, urdf: Path, tmp_path: Path) -> None:
    path = tmp_path / "identified.urdf"
    text = result.export("urdf", path)
    assert path.read_text() == text and "<robot" in text
    with pytest.raises(didim.UsageError, match="known: urdf"):
        result.export("pdf")


def test_errors_have_the_class_of_their_cause(robot: didim.Robot, urdf: Path, tmp_path: Path) -> None:
    time, q, torque = recording(robot, 1)
    with pytest.raises(didim.UsageError, match=r"torque has the shape \(10000, 1\); give \(10000, 2\)"):
        didim.Recording(time, q, torque[:, :1])
    with pytest.raises(didim.UsageError, match="give position.T"):
        didim.Recording(time, q.T, torque.T)
    with pytest.raises(didim.UsageError, match="one row per time"):
        didim.Recording(time, q, torque[1:])
    with pytest.raises(didim.UsageError, match="didim.read"):
        didim.identify(robot, str(urdf))  # type: ignore[arg-type]
    with pytest.raises(didim.UsageError, match="robot is of the type str"):
        didim.identify(str(urdf), didim.Recording(time, q, torque))  # type: ignore[arg-type]
    with pytest.raises(didim.UsageError, match="robot.cell"):
        didim.read(KR300 / "a.csv", robot)  # type: ignore[arg-type]
    with pytest.raises(didim.DataError, match="in seconds"):
        didim.identify(robot, didim.Recording(1e6 * time, q, torque))
    with pytest.raises(didim.UsageError, match="nowhere.*is no joint"):
        didim.identify(robot, didim.Recording(time, q, torque), joints=["nowhere"])
    with pytest.raises(didim.DataError, match="torque has a value that is no finite number"):
        didim.Recording(time, q, np.where(torque > 0.0, np.nan, torque))
    with pytest.raises(didim.DataError, match="time"):
        didim.Recording(np.zeros_like(time), q, torque)
    with pytest.raises(didim.DataError, match="3 joints, the robot 2"):
        didim.identify(robot, didim.Recording(time, np.c_[q, q[:, :1]], np.c_[torque, torque[:, :1]]))
    with pytest.raises(didim.ConfigurationError, match="nothing.urdf"):
        didim.Robot.from_urdf(tmp_path / "nothing.urdf", drive_inertia=True, friction=["viscous"])
    with pytest.raises(didim.UsageError, match="friction term `dry`"):
        didim.Robot.from_urdf(urdf, drive_inertia=True, friction=["dry"])
    with pytest.raises(didim.ConfigurationError, match="did you mean `cutoff_hz`"):
        didim.identify(robot, didim.Recording(time, q, torque), position_filter={"cutoff": 3.0})
    with pytest.raises(didim.ConfigurationError, match="controller"):
        didim.identify(robot, didim.Recording(time, q, torque), "didim", position_filter={"cutoff_hz": 10.0})
    with pytest.raises(didim.UsageError):
        didim.identify(robot, didim.Recording(time, q, torque), "least-squares")
    with pytest.raises(didim.DataError, match="the measurement lasts from 0 to 19.998 s"):
        didim.identify(robot, didim.Recording(time, q, torque), end=30.0)
    with pytest.raises(didim.ConfigurationError, match="nothere.toml"):
        didim.check(tmp_path / "nothere.toml")
    with pytest.raises(didim.UsageError):
        didim.run("identify", no_such_option=True)


def test_messages_name_arguments_in_place_of_options(robot: didim.Robot, tmp_path: Path) -> None:
    table, arm = tmp_path / "table.csv", tmp_path / "two_ends.urdf"
    table.write_text("time_s,joint_position_rad_1,joint_torque_nm_1\n" + "".join(f"{k / 500},0,0\n" for k in range(9)))
    links = "".join(f'<link name="{name}"/>' for name in ("base", "left", "right"))
    joint = '<joint name="{0}" type="revolute"><parent link="base"/><child link="{0}"/><axis xyz="0 0 1"/></joint>'
    arm.write_text(f'<robot name="two">{links}{joint.format("left")}{joint.format("right")}</robot>')
    with pytest.raises(didim.DataError, match="correct sample_rate or data.rate_hz") as refused:
        didim.read(table, robot.cell(500.0), sample_rate=100.0)
    errors = [refused.value]
    with pytest.raises(didim.ConfigurationError, match="name one with tip, or") as refused:
        didim.Robot.from_urdf(arm, drive_inertia=False, friction=["viscous"])
    errors.append(refused.value)
    time, q, torque = recording(robot, 1)
    with pytest.raises(didim.Error, match="start and end") as refused:
        didim.identify(robot, didim.Recording(time[:20], q[:20], torque[:20]))
    errors.append(refused.value)
    assert not [error for error in errors if "--" in str(error)]
    # A command for a shell is one.
    with pytest.raises(didim.ConfigurationError, match="`didim new CELL.toml --robot ARM.urdf --log"):
        didim.Cell.read(table)


def test_warnings_go_to_the_logger(robot: didim.Robot, caplog: pytest.LogCaptureFixture) -> None:
    time, q, torque = recording(robot, 1)
    with caplog.at_level(logging.WARNING, logger="didim"):
        q[:, 1] = 0.3
        try:
            didim.identify(robot, didim.Recording(time, q, torque), position_filter={"cutoff_hz": 10.0})
        except didim.Error:
            pass
    assert any("never moves" in record.message for record in caplog.records), caplog.records


def test_other_threads_go_on_while_it_identifies(robot: didim.Robot) -> None:
    data = didim.Recording(*recording(robot, 1))
    longest, stop = [0.0], threading.Event()

    def tick() -> None:
        while not stop.is_set():
            begin = clock.monotonic()
            clock.sleep(0.001)
            longest[0] = max(longest[0], clock.monotonic() - begin)

    ticking = threading.Thread(target=tick)
    ticking.start()
    begin = clock.monotonic()
    results = [didim.identify(robot, data, position_filter={"cutoff_hz": 10.0}) for _ in range(3)]
    lasted = clock.monotonic() - begin
    stop.set()
    ticking.join()
    assert longest[0] < 0.5 * lasted, (longest, lasted)
    assert len({result._native.json() for result in results}) == 1, "the same input, the same bytes"


def test_threads_give_the_bytes_of_one_after_the_other(robot: didim.Robot) -> None:
    data = {seed: didim.Recording(*recording(robot, seed)) for seed in (1, 2)}

    def identify(seed: int) -> str:
        return didim.identify(robot, data[seed], position_filter={"cutoff_hz": 10.0})._native.json()

    alone = {seed: identify(seed) for seed in data}
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(identify, [1, 2] * 4))
    assert together == [alone[1], alone[2]] * 4 and alone[1] != alone[2]


def test_an_interrupt_ends_the_wait(urdf: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        f"""
import signal
import numpy as np, didim
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
robot = didim.Robot.from_urdf({str(urdf)!r}, drive_inertia=True, friction=["viscous", "coulomb", "offset"])
time = np.arange(300_000) / 500.0
q = np.sin(np.outer(time, [1.0, 1.3])) + 0.3 * np.sin(np.outer(time, [3.1, 2.7]))
data = didim.Recording(time, q, np.random.default_rng(1).normal(size=q.shape))
try:
    print("begin", flush=True)
    didim.identify(robot, data)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    )
    running = subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None and running.stdout.readline() == "begin\n"
    clock.sleep(0.3)
    running.send_signal(signal.SIGINT)
    begin = clock.monotonic()
    assert running.stdout.readline() == "interrupted\n"
    assert clock.monotonic() - begin < 5.0
    running.wait(60)


def test_every_public_name_says_what_it_takes() -> None:
    for name in didim.__all__:
        of = getattr(didim, name)
        if name.startswith("__"):
            continue
        assert of.__doc__, name
        members = vars(of).items() if inspect.isclass(of) else [("", of)]
        for member, value in members:
            if member.startswith("_"):
                continue
            described = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
            if inspect.isfunction(described):
                full = f"{name}.{member}"
                text = inspect.getdoc(described) or ""
                assert text, full
                arguments = [of for of in inspect.signature(described).parameters if of not in ("self", "cls", "options")]
                assert not arguments or "Args:" in text or len(arguments) == 1, full
                for argument in arguments if "Args:" in text else []:
                    assert f"{argument}: " in text, f"{full}: {argument}"


def test_a_thousand_calls_leave_no_memory(robot: didim.Robot) -> None:
    _, q, dq, ddq = motion(3, seconds=2.0)
    values = truth(robot)

    def resident_kib() -> int:
        gc.collect()
        status = Path("/proc/self/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1])

    def calls(count: int) -> None:
        for _ in range(count):
            robot.regressor(q, dq, ddq)
            robot.inverse_dynamics(q, dq, ddq, values)
            didim.Recording(np.arange(len(q)) / 500.0, q, dq).position

    data = didim.Recording(*recording(robot, 1))

    def identifications(count: int) -> None:
        for _ in range(count):
            result = didim.identify(robot, data, position_filter={"cutoff_hz": 10.0}, end=4.0)
            result.predict(data), result.covariance, result.export("json")

    for work, warm, count, kind in ((calls, 50, 1000, "calls of 0.3 MB"), (identifications, 5, 20, "identifications")):
        work(warm)
        before = resident_kib()
        work(count)
        assert resident_kib() - before < 8 * 1024, f"{count} {kind}"
