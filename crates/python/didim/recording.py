"""Recordings: signals in memory, or read from a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .cell import Cell

if TYPE_CHECKING:
    import pandas as pd

_Array = NDArray[np.float64]

#: Signals of a table, by the argument of :class:`Recording`, with their units.
_SIGNALS = {"position": "position_rad", "torque": "torque_nm", "reference": "reference_rad"}


class Recording:
    """Positions and torques of a robot over time, on a uniform grid.

    Rows with jittering times are resampled. Missing rows cut the recording into pieces.

    Args:
        time: n times [s]: since the first sample, or since 1970-01-01T00:00:00Z.
        position: n × joints [rad or m].
        torque: n × joints [N·m or N].
        reference: Commanded positions, n × joints [rad or m].
        side: ``"joint"`` or ``"motor"``: the side of the transmission on which the signals were measured.

    Raises:
        UsageError: A shape is not n × joints.
        DataError: The times form no recording, or a value is no finite number.

    Example:
        >>> didim.Recording(time, np.deg2rad(position_deg), torque)
    """

    def __init__(
        self,
        time: ArrayLike,
        position: ArrayLike,
        torque: ArrayLike,
        reference: ArrayLike | None = None,
        *,
        side: str = "joint",
    ) -> None:
        if side not in ("joint", "motor"):
            raise _native.UsageError(f'side is "{side}"; give "joint" or "motor"')
        given = {"position": position, "torque": torque, "reference": reference}
        signals = {name: _signal(name, of, 2) for name, of in given.items() if of is not None}
        times = _signal("time", time, 1)
        for name, signal in signals.items():
            if len(signal) != len(times):
                transposed = signal.shape[1] == len(times)
                remedy = f"give {name}.T" if transposed else "give one row per time and one column per joint"
                raise _native.UsageError(f"{name} has the shape {signal.shape} for {len(times)} times; {remedy}")
        self._native = _native.Recording(times, motor_side=side == "motor", **signals)
        self._file: tuple[str, float | None] | None = None

    @classmethod
    def _of(cls, native: _native.Recording, file: tuple[str, float | None] | None) -> Recording:
        recording = cls.__new__(cls)
        recording._native = native
        recording._file = file
        return recording

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, *, time: str = "time_s", degrees: bool = False) -> Recording:
        """Takes the columns of a :class:`pandas.DataFrame` with the names of didim's tables.

        Args:
            frame: Columns ``joint_position_rad_1`` …, ``joint_torque_nm_1`` … and, if known, ``joint_reference_rad_1`` …;
                or the same with ``motor_``.
            time: Name of the column of times [s]; the index is used if no column has this name.
            degrees: True if positions and commanded positions are in degrees.

        Raises:
            UsageError: A column is missing.
            DataError: The times form no recording, or a value is no finite number.
        """
        side = "motor" if "motor_position_rad_1" in frame.columns else "joint"
        signals: dict[str, Any] = {}
        for argument, name in _SIGNALS.items():
            columns = [f"{side}_{name}_{joint + 1}" for joint in range(len(frame.columns))]
            present = [column for column in columns if column in frame.columns]
            if not present and argument != "reference":
                raise _native.UsageError(f"the frame has no column {columns[0]}; its columns are {list(frame.columns)}")
            if present:
                values = frame[present].to_numpy(dtype=np.float64)
                signals[argument] = np.deg2rad(values) if degrees and argument != "torque" else values
        times = frame[time] if time in frame.columns else frame.index
        return cls(np.asarray(times, dtype=np.float64), **signals, side=side)

    def __repr__(self) -> str:
        return f"<didim.Recording: {len(self.time)} samples of {self.joints} joints, {self.sample_rate:g} Hz>"

    @property
    def sample_rate(self) -> float:
        """Samples per second [Hz]."""
        return self._native.sample_rate

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self._native.joints

    @property
    def side(self) -> str:
        """``"joint"`` or ``"motor"``: the side of the transmission of its signals."""
        return "motor" if self._native.motor_side else "joint"

    @property
    def recorded(self) -> str | None:
        """Instant of the first sample as text (RFC 3339, UTC); ``None`` if unknown."""
        return self._native.recorded

    @property
    def notes(self) -> list[str]:
        """Changes that were made for a uniform grid, and gaps."""
        return self._native.notes

    @property
    def time(self) -> _Array:
        """Times of the samples after the first, n [s]. A step larger than a sample is a gap."""
        return np.concatenate([begin + np.arange(len(of)) / self.sample_rate for begin, of, *_ in self._native.signals()])

    @property
    def position(self) -> _Array:
        """Positions on the uniform grid, n × joints [rad or m]."""
        return np.concatenate([position for _, position, _, _ in self._native.signals()])

    @property
    def torque(self) -> _Array:
        """Torques on the uniform grid, n × joints [N·m or N]."""
        return np.concatenate([torque for _, _, torque, _ in self._native.signals()])

    @property
    def reference(self) -> _Array | None:
        """Commanded positions on the uniform grid, n × joints [rad or m]; ``None`` if unknown."""
        found = [of for *_, of in self._native.signals() if of is not None]
        return np.concatenate(found) if found else None

    def signals(self) -> list[tuple[float, _Array, _Array]]:
        """Returns the pieces without gaps: start after the first sample [s], positions and torques."""
        return [(begin, position, torque) for begin, position, torque, _ in self._native.signals()]

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the signals as a table (CSV) in SI units, which every command reads. Times count from the first sample."""
        signals: Mapping[str, _Array | None] = {name: getattr(self, of) for of, name in _SIGNALS.items()}
        known = {name: of for name, of in signals.items() if of is not None}
        names = [f"{self.side}_{name}_{joint + 1}" for name in known for joint in range(self.joints)]
        with open(path, "w", encoding="utf-8") as out:
            out.write(",".join(["time_s", *names]) + "\n")
            out.writelines(_lines(np.column_stack([self.time, *known.values()])))


def _lines(rows: _Array) -> Iterator[str]:
    """Returns the lines of a table; each number is the shortest text that stands for it."""
    for row in rows:
        yield ",".join(map(repr, row.tolist())) + "\n"


def _signal(name: str, array: ArrayLike, dimensions: int) -> _Array:
    """Returns an argument as float64, without a copy where it is."""
    try:
        signal = np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise _native.UsageError(f"{name} is no array of numbers: {error}") from error
    if signal.ndim != dimensions:
        wanted = "n: one time per sample" if dimensions == 1 else "n × joints: one row per sample and one column per joint"
        raise _native.UsageError(f"{name} has the shape {signal.shape}; give {wanted}")
    return signal


def read(path: str | PathLike[str], cell: Cell, *, sample_rate: float | None = None) -> Recording:
    """Reads a recording in any format of the command line: tables, ROS 2 bags, logs of a bus.

    Args:
        path: The file, or the folder of a bag.
        cell: The cell that describes its columns, topics or frames.
        sample_rate: Samples per second of a table without a time column [Hz].

    Raises:
        DataError: The file cannot be read. The message names the place and the remedy.
        UsageError: A robot is given in place of a cell.
    """
    if not isinstance(cell, Cell):
        kind = type(cell).__name__
        raise _native.UsageError(f"cell is of the type {kind}; give a didim.Cell, for example robot.cell(sample_rate)")
    native = _native.read(fspath(path), cell._native, sample_rate)
    return Recording._of(native, (str(Path(path).absolute()), sample_rate))
