"""Identification and its result."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, fields
from os import PathLike, fspath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .cell import Cell, Robot
from .recording import Recording
from .table import Parameters, Table, digits, optional


@dataclass(frozen=True)
class Finding:
    """What the judgement of a result found, as data.

    Attributes:
        code: Its code; ``man didim-findings`` lists them.
        severity: ``blocking``, ``deciding``, ``explanatory`` or ``informative``.
        message: The sentence for people.
        data: Every key of the finding in JSON: subject, figure, limit, unit, the key to set.
    """

    code: str
    severity: str
    message: str
    data: dict[str, Any]


@dataclass(frozen=True)
class UseVerdict:
    """Verdict for one use of a result.

    Attributes:
        usable: True if the result is usable for it; ``None`` if that cannot be decided.
        figure: The deciding figure.
        unit: Its unit; ``1`` is a share.
        limit: Largest permitted figure.
        reasons: Reasons against the use.
    """

    usable: bool | None
    figure: float | None
    unit: str
    limit: float | None
    reasons: list[str]


@dataclass(frozen=True, repr=False)
class Verdict(Table):
    """Verdict for each use of a result.

    Attributes:
        applicable: True if there is no reason against the uses that the cell requires.
        notes: Notes that do not affect the use.
    """

    applicable: bool
    monitoring: UseVerdict
    prediction: UseVerdict
    contact_detection: UseVerdict
    physical_values: UseVerdict
    rigid_body: UseVerdict
    notes: list[str]

    def _rows(self) -> list[list[str]]:
        def number(value: float | None, unit: str) -> str:
            return "–" if value is None else f"{digits(100.0 * value)} %" if unit == "1" else f"{digits(value)} {unit}"

        words = {True: "yes", False: "no", None: "undecided"}
        uses = [(of.name, getattr(self, of.name)) for of in fields(self)]

        def because(use: UseVerdict) -> str:
            # A reason begins with what is wrong. The remedy follows a colon.
            return use.reasons[0].split(":")[0] if use.reasons else ""

        return [["use", "usable", "figure", "limit", "because"]] + [
            [name.replace("_", " "), words[of.usable], number(of.figure, of.unit), number(of.limit, of.unit), because(of)]
            for name, of in uses
            if isinstance(of, UseVerdict)
        ]


@dataclass(frozen=True, repr=False)
class Prediction:
    """Torques of a recording, and those that a result predicts. Both passed the filters of the cell.

    Attributes:
        time: Times of the rows [s].
        measured: Measured torques, rows × joints [N·m or N].
        predicted: Predicted torques, rows × joints [N·m or N].
        relative_error: ‖measured − predicted‖ / ‖measured‖ over all joints.
        expected_error: The relative error that the result expects along this motion; ``None`` if it states none.
        data: The JSON object of ``didim predict --json``, without the notes.
    """

    time: NDArray[np.float64]
    measured: NDArray[np.float64]
    predicted: NDArray[np.float64]
    relative_error: float
    expected_error: float | None
    data: dict[str, Any]

    def __repr__(self) -> str:
        rows, joints = self.measured.shape
        expected = "" if self.expected_error is None else f", expected {100.0 * self.expected_error:.2f} %"
        return f"<didim.Prediction: {rows} rows of {joints} joints, error {100.0 * self.relative_error:.2f} %{expected}>"

    def plot(self) -> Any:
        """Draws measured and predicted torques of each joint with matplotlib. Returns the figure."""
        return _figure(self.time, self.measured, self.predicted)


class ExportedModel(str):
    """The text of an exported model.

    Attributes:
        left_out: Parts of the model that the format cannot hold.
    """

    left_out: list[str]

    def __new__(cls, text: str, left_out: list[str]) -> ExportedModel:
        model = super().__new__(cls, text)
        model.left_out = left_out
        return model


class Result:
    """An identified robot. Create one by :func:`identify`."""

    def __init__(self, native: _native.Result, cell: Cell, joints: list[str] | None = None) -> None:
        self._native = native
        self._cell = cell
        self._joints = joints
        #: The JSON object of ``didim identify --json``, without the data of the recordings.
        self.data: dict[str, Any] = json.loads(native.json())

    def __repr__(self) -> str:
        error = 100.0 * self.data["relative_error"]
        return f"<didim.Result: {len(self.parameters)} parameters of {self.data['robot']}, error {error:.2f} %>"

    def _repr_html_(self) -> str:
        return self.parameters._repr_html_()

    @property
    def parameters(self) -> Parameters:
        """The parameters, in the model's order."""
        return Parameters._of(self.data["parameters"])

    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """Statistical covariance of the parameters, in their order and units; ``None`` if the method gives none."""
        return self._native.covariance()

    @property
    def relative_error(self) -> float:
        """‖y − Xθ‖ / ‖y‖ of the recordings, over all joints."""
        return float(self.data["relative_error"])

    @property
    def verdict(self) -> Verdict:
        """The verdict for each use."""
        verdict = self.data["verdict"]

        def of(name: str) -> UseVerdict:
            use = verdict["uses"][name]
            return UseVerdict(use["applicable"], use["figure"], use["unit"], use["limit"], use["reasons"])

        return Verdict(
            verdict["applicable"],
            of("monitoring"),
            of("prediction"),
            of("contact-detection"),
            of("physical-values"),
            of("rigid-body"),
            verdict.get("notes", []),
        )

    @property
    def findings(self) -> list[Finding]:
        """Every finding: the reasons against any use, and the notes."""
        return [Finding(of["code"], of["severity"], of["message"], of) for of in self.data["verdict"]["findings"]]

    def predict(
        self, data: Recording | Sequence[Recording], *, start: float | None = None, end: float | None = None
    ) -> Prediction:
        """Predicts the torques of a recording that the result was not identified from. Nothing is fitted.

        Args:
            data: One recording or several.
            start: Start of the samples that count [s after the first].
            end: End of the samples that count [s after the first].

        Raises:
            DataError: The recording does not fit the robot.
        """
        text, time, measured, predicted = self._native.predict(_natives(data), start, end)
        found = json.loads(text)
        expected = found["foretold"]
        expected = None if expected is None else expected["relative_error"]
        return Prediction(time, measured, predicted, found["relative_error"], expected, found)

    def export(
        self,
        format: str,
        path: str | PathLike[str] | None = None,
        *,
        name: str = "arm",
        total_mass_kg: float | None = None,
    ) -> ExportedModel:
        """Returns the model as text, with physically consistent parameters.

        The notes of ``didim export`` go to the logger ``didim``.

        Args:
            format: ``"urdf"``, ``"mjcf"``, ``"toml"``, ``"json"``, ``"matlab"``, ``"c"`` or ``"rust"``.
            path: File to write as well.
            name: Name of the model in the text.
            total_mass_kg: Mass of all moving links from the data sheet [kg], for a robot without nominal bodies.

        Raises:
            UsageError: The format is unknown.
            IdentificationError: No physically consistent parameters are near, or the robot has no nominal bodies.
        """
        file = None if path is None else fspath(path)
        return ExportedModel(*self._native.export(format, name, file, total_mass_kg))

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the result to a file, which ``didim predict``, ``advise`` and ``export`` read."""
        self._native.save(fspath(path))

    def report(self, path: str | PathLike[str]) -> None:
        """Writes a report: one HTML file."""
        self._native.report(fspath(path))

    def plot(self) -> Any:
        """Draws measured and fitted torques of each joint with matplotlib. Returns the figure."""
        return _figure(*self._native.fit(), self._cell.joint_names)


def _figure(
    time: NDArray[np.float64],
    measured: NDArray[np.float64],
    predicted: NDArray[np.float64],
    names: Sequence[str] | None = None,
) -> Any:
    plt = optional("matplotlib.pyplot", "plot")
    joints = measured.shape[1]
    size = (8.0, 1.0 + 1.3 * joints)
    figure, axes = plt.subplots(joints, 1, sharex=True, squeeze=False, figsize=size, layout="constrained")
    for joint, axis in enumerate(axes[:, 0]):
        for label, torque in (("measured", measured), ("model", predicted)):
            # A gap of several pieces is no line.
            axis.plot(*_with_gaps(time, torque[:, joint]), label=label, linewidth=0.8)
        axis.set_ylabel(names[joint] if names else f"joint {joint + 1}", fontsize="small")
    figure.supylabel("torque [N·m], force [N]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", fontsize="small", ncols=2)
    axes[-1, 0].set_xlabel("time [s]")
    return figure


def _with_gaps(time: NDArray[np.float64], signal: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns the signal with NaN where rows are missing."""
    steps = np.diff(time)
    gaps = 1 + np.flatnonzero((steps > 1.5 * np.median(steps)) | (steps < 0.0))
    return np.insert(time, gaps, np.nan), np.insert(signal, gaps, np.nan)


def _natives(data: Recording | Sequence[Recording]) -> list[_native.Recording]:
    recordings = [data] if isinstance(data, (Recording, str, PathLike)) else list(data)
    if not recordings:
        raise _native.UsageError("give at least one recording")
    for recording in recordings:
        if not isinstance(recording, Recording):
            kind = type(recording).__name__
            raise _native.UsageError(f"data is of the type {kind}; give a didim.Recording, or read a file by didim.read")
    return [recording._native for recording in recordings]


def _cell_of(robot: Robot, sample_rate: float, identification: dict[str, Any]) -> Cell:
    try:
        return robot.cell(sample_rate, **identification)
    except _native.ConfigurationError as error:
        if "`data.rate_hz`" not in str(error):
            raise
        problem = f"the recording has {sample_rate:g} samples per second; its times have to be in seconds"
        raise _native.DataError(problem) from error


def identify(
    robot: Robot | Cell,
    data: Recording | Sequence[Recording],
    method: str | None = None,
    *,
    start: float | None = None,
    end: float | None = None,
    joints: Sequence[int | str] | None = None,
    **identification: Any,
) -> Result:
    """Identifies the parameters of a robot from one recording or several of the same arm.

    Args:
        robot: The robot, or a cell with all settings.
        data: The recordings, on the joint side unless the robot has gear ratios.
        method: ``"idim-ls"``, ``"idim-iv"``, ``"clie"``, ``"cloe"`` or ``"didim"``; the cell's if left out.
        start: Start of the samples that count [s after the first]; earlier ones are margin for the filters.
        end: End of the samples that count [s after the first].
        joints: Joints whose torques are used, by number from 1 or by name; all if left out.
        identification: Keys of ``[identification]`` in a cell file, as :meth:`Robot.cell` takes them.

    Raises:
        DataError: A recording does not fit the robot.
        UsageError: The arm has no such joint, or the method is unknown.
        IdentificationError: The method refused the data or failed.
        ConfigurationError: A setting is wrong.

    Example:
        >>> result = didim.identify(robot, [first, second], position_filter={"cutoff_hz": 10.0})
        >>> result.parameters["fc1"].value
    """
    natives = _natives(data)
    if isinstance(robot, Robot):
        cell = _cell_of(robot, natives[0].sample_rate, identification)
    elif not isinstance(robot, Cell):
        raise _native.UsageError(f"robot is of the type {type(robot).__name__}; give a didim.Robot or a didim.Cell")
    elif identification:
        raise _native.UsageError(f"`{next(iter(identification))}` is a key of the cell; change the cell")
    else:
        cell = robot
    names = None if joints is None else [str(joint) for joint in joints]
    native = cell._native if names is None else cell._native.with_torque_joints(names)
    return Result(_native.identify(native, natives, method, start, end), cell, names)
