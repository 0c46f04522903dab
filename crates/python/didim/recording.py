"""Recordings: signals in memory, or read from a file."""

from __future__ import annotations

from os import PathLike, fspath

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .cell import Cell


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
        self._native = _native.Recording(
            np.asarray(time, dtype=np.float64),
            np.asarray(position, dtype=np.float64),
            np.asarray(torque, dtype=np.float64),
            None if reference is None else np.asarray(reference, dtype=np.float64),
            side == "motor",
        )

    @classmethod
    def _of(cls, native: _native.Recording) -> Recording:
        recording = cls.__new__(cls)
        recording._native = native
        return recording

    def __repr__(self) -> str:
        rows = sum(len(position) for _, position, _ in self._native.signals())
        return f"<didim.Recording: {rows} samples of {self.joints} joints, {self.sample_rate:g} Hz>"

    @property
    def sample_rate(self) -> float:
        """Samples per second [Hz]."""
        return self._native.sample_rate

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self._native.joints

    @property
    def recorded(self) -> str | None:
        """Instant of the first sample as text (RFC 3339, UTC); ``None`` if unknown."""
        return self._native.recorded

    @property
    def notes(self) -> list[str]:
        """Changes that were made for a uniform grid, and gaps."""
        return self._native.notes

    def signals(self) -> list[tuple[float, NDArray[np.float64], NDArray[np.float64]]]:
        """Returns the pieces without gaps: start after the first sample [s], positions and torques."""
        return self._native.signals()


def read(path: str | PathLike[str], cell: Cell, *, sample_rate: float | None = None) -> Recording:
    """Reads a recording in any format of the command line: tables, ROS 2 bags, logs of a bus.

    Args:
        path: The file, or the folder of a bag.
        cell: The cell that describes its columns, topics or frames.
        sample_rate: Samples per second of a table without a time column [Hz].

    Raises:
        DataError: The file cannot be read. The message names the place and the remedy.
    """
    return Recording._of(_native.read(fspath(path), cell._native, sample_rate))
