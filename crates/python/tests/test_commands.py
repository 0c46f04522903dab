"""The commands as functions: the numbers of the command line, from objects in memory."""

from __future__ import annotations

import json
import logging
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import didim
from conftest import FC, FV, ROOT, recording, truth

KR300 = ROOT / "tests/data/kr300"
TX40 = ROOT / "config/cells/tx40-paper.toml"
STATE = ROOT / "tests/data/stored/state"

#: A load on the elbow's link [kg], beside its axis [m].
MASS, CENTRE = 2.0, [0.5, 0.0, 0.0]


@pytest.fixture(autouse=True)
def nothing_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Temporary files go to a folder of the test, which is empty in the end."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield
    assert list(folder.iterdir()) == []


@pytest.fixture(scope="module")
def empty(robot: didim.Robot) -> didim.Recording:
    return didim.Recording(*recording(robot, 1))


@pytest.fixture(scope="module")
def loaded(robot: didim.Robot) -> didim.Recording:
    values = truth(robot)
    x, m = CENTRE[0], MASS
    for name, added in (("m2", m), ("mx2", m * x), ("yy2", m * x * x), ("zz2", m * x * x)):
        if name in robot.parameter_names:
            values[robot.parameter_names.index(name)] += added
    return didim.Recording(*recording(robot, 3, values))


@pytest.fixture(scope="module")
def result(robot: didim.Robot, empty: didim.Recording) -> didim.Result:
    return didim.identify(robot, empty, position_filter={"cutoff_hz": 10.0})


def test_a_table_of_arrays_is_read_as_the_arrays(robot: didim.Robot, empty: didim.Recording, tmp_path: Path) -> None:
    table, cell_file = tmp_path / "arm.csv", tmp_path / "cell.toml"
    empty.save(table)
    cell = robot.cell(empty.sample_rate, position_filter={"cutoff_hz": 10.0})
    cell.save(cell_file)
    printed = json.loads(didim.run("identify", cell=cell_file, input=table, json=True))
    for key, value in didim.identify(cell, empty).data.items():
        assert json.dumps(value) == json.dumps(printed[key]), key
    again = didim.read(table, cell)
    assert np.array_equal(again.position, empty.position) and np.array_equal(again.torque, empty.torque)
    assert again.sample_rate == empty.sample_rate and again.side == "joint" and again.reference is None
    with pytest.raises(didim.UsageError, match="use this file"):
        didim.Cell.read(cell_file).save(tmp_path / "other.toml")


def test_a_payload_of_arrays_lies_within_its_uncertainty(
    robot: didim.Robot, result: didim.Result, loaded: didim.Recording
) -> None:
    found = didim.payload(result, loaded)
    assert found.present, found
    known = [of for of in found.parameters if of.name in ("mx", "my")]
    assert known, found.parameters
    for of in known:
        wanted = MASS * CENTRE[0] if of.name == "mx" else 0.0
        assert abs(of.value - wanted) < 4.0 * of.standard_deviation, of
    assert found.relative_errors[1] < 0.5 * found.relative_errors[0]
    assert "mass" in repr(found) and "<table>" in found._repr_html_()
    none = didim.payload(result, didim.Recording(*recording(robot, 4)))
    assert not none.present, none


def test_payload_is_that_of_the_command_line(tmp_path: Path) -> None:
    cell = didim.Cell.read(KR300 / "cell.toml")
    result = didim.identify(cell, didim.read(KR300 / "a.csv", cell), start=1.8, end=8.2)
    saved = tmp_path / "result.json"
    result.save(saved)
    data = didim.read(KR300 / "c.csv", cell)
    found = didim.payload(result, data, start=1.8, end=8.196, declared_mass_kg=3.0)
    line = {"cell": KR300 / "cell.toml", "result": saved, "input": KR300 / "c.csv", "json": True}
    printed = json.loads(didim.run("payload", from_=1.8, to=8.196, declared_mass_kg=3.0, **line))
    assert found.data == printed
    assert found.mass is not None and found.mass.value == printed["load"]["mass_kg"]["value"]
    arrays = didim.Recording(data.time, data.position, data.torque, side=data.side)
    from_arrays = didim.payload(saved, arrays, cell, start=1.8, end=8.196, declared_mass_kg=3.0)
    assert from_arrays.data == printed


def test_gains_come_from_a_recording_with_a_load(
    robot: didim.Robot, empty: didim.Recording, loaded: didim.Recording
) -> None:
    halved = [didim.Recording(of.time, of.position, of.torque * [1.0, 0.5]) for of in (empty, loaded)]
    found = didim.gains(robot, *halved, declared_mass_kg=MASS, declared_centre_m=CENTRE)
    assert [of.joint for of in found.gains] == [1, 2]
    for of, wanted in zip(found.gains, [1.0, 2.0]):
        assert of.found is not None and abs(of.found.value / wanted - 1.0) < 0.1, found
    assert "fv1" in found.parameters.names
    with pytest.raises(didim.UsageError, match="declared_mass_kg"):
        didim.gains(robot, empty, loaded)


def test_methods_are_compared(robot: didim.Robot, empty: didim.Recording) -> None:
    found = didim.compare(robot, empty, methods=["idim-ls"], folds=3)
    (method,) = found.methods
    assert method.method == "idim-ls" and method.failure is None
    assert abs(method.parameters["fc1"].value - FC[0]) < 4.0 * method.parameters["fc1"].combined_standard_deviation
    assert 0.0 < found.held_out_errors["idim-ls"] < 0.2 and found.truth is None
    with pytest.raises(didim.ConfigurationError, match="controller"):
        didim.compare(robot, empty, methods=["didim"])
    simulated = didim.compare(TX40, scenario="tx40-paper", methods=["idim-ls"], folds=0)
    assert simulated.truth is not None and simulated.truth["zz1r"] == 1.24


SCENARIO: dict[str, Any] = {
    "name": "two axes",
    "robot": "two_axes",
    "samples": 6000,
    "motion": {
        "acceleration_max_rad_s2": [8.0, 8.0],
        "start_rad": [0.0, 0.0],
        "start_dwell_s": 0.1,
        "moves": [
            {"target_rad": [1.0, -1.0], "velocity_fraction": 0.5, "acceleration_fraction": 0.9, "dwell_s": 0.1},
            {"target_rad": [-0.8, 0.9], "velocity_fraction": 0.8, "acceleration_fraction": 0.7, "dwell_s": 0.1},
            {"target_rad": [0.3, 0.0], "velocity_fraction": 0.3, "acceleration_fraction": 0.5, "dwell_s": 0.1},
        ],
    },
    "playback": {"lead_in_s": 0.5, "tail_s": 0.5, "cycles": 1},
    "controller": {
        "timing": {"kind": "sampled", "sample_period_s": 0.001, "computation_delay_s": 0.0},
        "joints": [
            {"torque_limit_nm": 900.0, "law": {"kind": "pd", "kp_per_rad": kp, "kd_s_per_rad": kd, "k_tau_nm": 1.0}}
            for kp, kd in ((8000.0, 400.0), (3000.0, 100.0))
        ],
    },
    "simulation": {
        "integrator": "ode3",
        "substeps": 1,
        "noise": {"seed": 1, "disturbance_torque_nm": [1.0, 0.4]},
    },
}


def test_a_robot_of_arrays_is_simulated_and_found_again(robot: didim.Robot) -> None:
    nominal = dict(zip(robot.parameter_names, truth(robot)))
    simulated = didim.simulate(robot, {**SCENARIO, "nominal": nominal})
    data = simulated.recording
    assert data.sample_rate == pytest.approx(1000.0) and data.torque.shape == (7000, 2) and data.side == "motor"
    assert simulated.truth["fv1"] == FV[0]
    found = didim.identify(robot, data)
    for of in found.parameters:
        assert abs(of.value - simulated.truth[of.name]) < 5.0 * of.combined_standard_deviation, of
    other = didim.simulate(robot, {**SCENARIO, "nominal": nominal}, seed=2)
    assert not np.array_equal(other.recording.torque, data.torque)
    with pytest.raises(didim.ConfigurationError, match="two_axes"):
        didim.simulate(robot, {**SCENARIO, "robot": "one_axis"})


def test_a_motion_is_designed_with_what_was_checked(
    robot: didim.Robot, result: didim.Result, tmp_path: Path
) -> None:
    further = tmp_path / "motion.yaml"
    motion = didim.design(robot, 6.0, acceleration=8, steps=20, out=further, no_plane=True)
    rows = len(motion.time)
    assert motion.position.shape == motion.velocity.shape == motion.acceleration.shape == (rows, 2)
    step = motion.time[1] - motion.time[0]
    speeds = np.gradient(motion.position, step, axis=0)
    assert np.allclose(speeds[5:-5], motion.velocity[5:-5], atol=0.02)
    assert np.abs(motion.acceleration).max() <= 8.0
    assert any("FIRST RUN IT AT 10 % SPEED" in line for line in motion.statement)
    assert any(line.startswith("Collision") for line in motion.statement)
    assert "fc1" in motion.summary and further.exists()
    saved = tmp_path / "motion.csv"
    motion.save(saved)
    of_program = tmp_path / "program.csv"
    cell_file = tmp_path / "cell.toml"
    robot.cell(1000.0).save(cell_file)
    didim.run("design", cell=cell_file, duration=6.0, acceleration=8, steps=20, out=of_program, no_plane=True)
    assert saved.read_text() == of_program.read_text()
    nominal = dict(zip(robot.parameter_names, truth(robot)))
    played = didim.simulate(robot, {**SCENARIO, "nominal": nominal}, motion=motion)
    middle = played.recording.position[len(played.recording.time) // 2]
    assert np.abs(motion.position - middle).max(axis=1).min() < 0.05
    with pytest.raises(didim.UsageError, match="steps"):
        didim.design(robot, 6.0, acceleration=8, steps=0)


def test_a_history_and_a_fleet_are_tables(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    history = didim.history(STATE)
    assert history.data == json.loads(didim.run("history", state=STATE, json=True))
    frame = history.to_frame()
    assert len(frame) == sum(len(of["parameters"]) for of in history.results)
    assert frame.loc[frame["parameter"] == "zz1r", "value"].iloc[0] == pytest.approx(1.23829, rel=1e-5)
    assert "tx40" not in repr(history) and "didim" in repr(history)
    with pytest.raises(didim.IdentificationError):
        didim.fleet(STATE)


def test_errors_name_the_argument_and_not_its_file(
    robot: didim.Robot, result: didim.Result, empty: didim.Recording
) -> None:
    wide = didim.Recording(empty.time, np.c_[empty.position, empty.position], np.c_[empty.torque, empty.torque])
    with pytest.raises(didim.DataError, match="^data: .*4 joints") as raised:
        didim.payload(result, wide)
    assert "/tmp" not in str(raised.value) and ".csv" not in str(raised.value)
    with pytest.raises(didim.UsageError, match="^.*frame"):
        didim.payload(result, empty, frame="nowhere")
    with pytest.raises(didim.DataError, match="nothing.csv"):
        didim.payload(result, "nothing.csv")


def test_notes_of_a_command_go_to_the_logger(robot: didim.Robot, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="didim"):
        didim.compare(robot, didim.Recording(*recording(robot, 1)), folds=0)
    assert any(record.message.startswith("cell has no [controller]") for record in caplog.records), caplog.records
    caplog.clear()
    time, q, torque = recording(robot, 1)
    with caplog.at_level(logging.WARNING, logger="didim"):
        didim.compare(robot, didim.Recording(time / 3.0, q, torque), methods=["idim-ls"], folds=0)
    assert any(record.message.startswith("data: the speed of joint") for record in caplog.records), caplog.records


def test_an_export_says_what_the_format_cannot_hold(result: didim.Result, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="didim"):
        model = result.export("urdf")
    assert any("drive inertia" in part for part in model.left_out)
    assert {f"left out: {part}" for part in model.left_out} <= {record.message for record in caplog.records}
    assert result.export("json").left_out == []


def test_a_frame_of_pandas_is_a_recording(empty: didim.Recording) -> None:
    pandas = pytest.importorskip("pandas")
    columns = {"time_s": empty.time}
    for joint in range(2):
        columns[f"joint_position_rad_{joint + 1}"] = np.rad2deg(empty.position[:, joint])
        columns[f"joint_torque_nm_{joint + 1}"] = empty.torque[:, joint]
    frame = pandas.DataFrame(columns)
    found = didim.Recording.from_frame(frame, degrees=True)
    assert np.allclose(found.position, empty.position, rtol=1e-12) and np.array_equal(found.torque, empty.torque)
    indexed = didim.Recording.from_frame(frame.set_index("time_s"), degrees=True)
    assert np.array_equal(indexed.torque, found.torque)
    with pytest.raises(didim.UsageError, match="joint_torque_nm_1"):
        didim.Recording.from_frame(frame.filter(regex="time|position"))
