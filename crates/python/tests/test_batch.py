"""Batches of recordings: one output each, whatever maps them and whatever ends in between."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import didim
from conftest import motion, truth


@pytest.fixture(scope="module")
def cell(robot: didim.Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cell") / "arm.toml"
    robot.cell(200.0, position_filter={"cutoff_hz": 20.0}).save(path)
    return path


@pytest.fixture(scope="module")
def files(robot: didim.Robot, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Four recordings, and one that nobody can read."""
    folder = tmp_path_factory.mktemp("recordings")
    paths = [folder / f"{seed}.csv" for seed in range(4)]
    for seed, path in enumerate(paths):
        time, q, dq, ddq = motion(seed, seconds=10.0, rate=200.0)
        random = np.random.default_rng(seed)
        torque = robot.inverse_dynamics(q, dq, ddq, truth(robot)) + random.normal(0.0, [1.0, 0.4], q.shape)
        didim.Recording(time, q, torque).save(path)
    damaged = folder / "damaged.csv"
    damaged.write_text("time_s,q\n0,1\n")
    return [*paths, damaged]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_outputs_are_the_same_bytes_whatever_maps(files: list[Path], cell: Path, tmp_path: Path) -> None:
    one = didim.batch(files, cell, tmp_path / "one")
    assert [of.state for of in one] == ["computed"] * 4 + ["refused"]
    assert [of.file for of in one] == [str(path) for path in files]
    assert "damaged.csv" in (one.refused[0].why or "")
    expected = contents(tmp_path / "one")
    assert len(expected) == 4
    with ThreadPoolExecutor(2) as pool:
        didim.batch(files, cell, tmp_path / "threads", map=pool.map)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as processes:
        didim.batch(files, lambda _: cell, tmp_path / "processes", map=processes.map)
    assert contents(tmp_path / "threads") == contents(tmp_path / "processes") == expected
    # The numbers are those of one identification.
    known = didim.Cell.read(cell)
    alone = didim.identify(known, didim.read(files[0], known))
    values = [[of["value"] for of in result["parameters"]] for result in one.results()]
    assert len(values) == 4 and [of.value for of in alone.parameters] in values


def test_a_batch_that_was_interrupted_is_completed(files: list[Path], cell: Path, tmp_path: Path) -> None:
    def dies(work: object, tasks: list[object]) -> Iterator[didim.Output]:
        assert callable(work)
        for task in tasks[:2]:
            yield work(task)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        didim.batch(files, cell, tmp_path, map=dies)
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert len(before) == 2
    done = didim.batch(files, cell, tmp_path)
    assert [of.state for of in done] == ["there", "there", "computed", "computed", "refused"]
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in before} == before
    # A file under two names is one input, and a file that is missing costs no other.
    again = didim.batch([files[0], files[0], tmp_path / "missing.csv"], cell, tmp_path)
    assert [of.state for of in again] == ["there", "there", "refused"]
    assert again[0].path == again[1].path and "No such file" in (again[2].why or "")
    assert len(list(again.results())) == 4
    assert repr(again) == "<didim.Batch of 3: 2 there, 1 refused>"


def test_another_configuration_is_another_input(robot: didim.Robot, files: list[Path], tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    robot.cell(200.0, position_filter={"cutoff_hz": 20.0}).save(cell)
    first = didim.batch(files[:1], cell, tmp_path / "out")

    def changes(work: object, tasks: list[object]) -> Iterator[didim.Output]:
        assert callable(work)
        cell.unlink()
        robot.cell(200.0, position_filter={"cutoff_hz": 16.0}).save(cell)
        yield from map(work, tasks)

    # A cell that changes meanwhile would give outputs of another configuration than their name says.
    robot.cell(200.0, position_filter={"cutoff_hz": 18.0}).save(cell)
    with pytest.raises(didim.ConfigurationError, match="another one than that of the batch"):
        didim.batch(files[:1], cell, tmp_path / "out", map=changes)
    second = didim.batch(files[:1], cell, tmp_path / "out")
    assert second[0].state == "computed" and second[0].path != first[0].path
    with pytest.raises(didim.UsageError, match="give its file"):
        didim.batch(files, didim.Cell.read(cell), tmp_path)  # type: ignore[arg-type]
    with pytest.raises(didim.UsageError, match="a list of paths"):
        didim.batch(str(files[0]), cell, tmp_path)
    with pytest.raises(didim.UsageError, match="one for each task"):
        didim.batch(files, cell, tmp_path / "out", map=lambda work, tasks: map(work, reversed(tasks)))


def test_a_data_set_has_folders_by_arm_and_day(files: list[Path], cell: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow")
    # Two batches of one arm and day, and the second twice.
    didim.batch(files[:2], cell, tmp_path / "out").to_parquet(tmp_path / "set")
    done = didim.batch(files[2:], cell, tmp_path / "out")
    for _ in range(2):
        done.to_parquet(tmp_path / "set")
    table = parquet.read_table(tmp_path / "set")
    results = {result["input"]["sha256"]: result for result in done.results()}
    assert len(results) == 4
    assert table.num_rows == sum(len(result["parameters"]) for result in results.values())
    assert {row["arm"] for row in table.to_pylist()} == {"python"}
    for row in table.to_pylist():
        result = results[row["input"]]
        [parameter] = [of for of in result["parameters"] if of["name"] == row["parameter"]]
        assert row["value"] == parameter["value"] and row["day"] == "unknown"
        assert row["prediction"] == result["verdict"]["uses"]["prediction"]["applicable"]
