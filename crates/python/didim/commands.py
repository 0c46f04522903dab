"""The commands of the program as functions on objects.

Each runs the command of its name, so that its numbers are those of the command line. ``options`` are further options of
the command: ``torque_joints=[1, 2]`` would be ``--torque-joints 1 --torque-joints 2``. Notes go to the logger ``didim``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .cell import Cell, Robot
from .program import Call, toml
from .recording import Recording
from .result import Finding, Result
from .table import Parameters, Table, UncertainValue, digits, number, optional

if TYPE_CHECKING:
    import pandas as pd

_Path = str | PathLike[str]
_Rows = list[list[str]]


def _findings(found: Sequence[Mapping[str, Any]]) -> list[Finding]:
    return [Finding(of["code"], of["severity"], of["message"], dict(of)) for of in found]


def _point(point: Sequence[float] | None) -> str | None:
    """Returns a point as the value of an option."""
    return None if point is None else ",".join(str(float(of)) for of in point)


def check(cell: Robot | Cell | _Path, **options: Any) -> Any:
    """Checks a cell, as ``didim check``.

    Args:
        cell: The cell or its file.

    Returns:
        The findings: the JSON object of ``didim check --json``.

    Raises:
        ConfigurationError: The cell cannot be read.
    """
    with Call() as call:
        return call.json("check", cell=call.cell(cell), **options)


@dataclass(frozen=True, repr=False)
class Simulation:
    """A simulated experiment with its true parameters.

    Attributes:
        recording: The signals of the motors.
        truth: True base parameters of the arm without a payload by name, in SI units.
        data: The JSON object of ``didim sim --json``.
    """

    recording: Recording
    truth: dict[str, float]
    data: dict[str, Any]

    def __repr__(self) -> str:
        return f"<didim.Simulation {self.data['scenario']}: {self.recording!r}>"


def simulate(
    robot: Robot | Cell | _Path,
    scenario: Mapping[str, Any] | _Path,
    *,
    motion: Motion | _Path | None = None,
    seed: int | None = None,
    **options: Any,
) -> Simulation:
    """Simulates an arm in its closed control loop, as ``didim sim``.

    Args:
        robot: The robot, or a cell.
        scenario: The keys of a scenario file, such a file, or the name of a shipped scenario (``"tx40-paper"``).
        motion: A designed motion in place of the scenario's.
        seed: Seed of the noise; the scenario's if left out.

    Returns:
        The recording, at the rate of the scenario's controller, and the true parameters.

    Raises:
        ConfigurationError: The scenario is wrong, or for another robot. The message names the key.
        UsageError: The scenario cannot be read.
        IdentificationError: The simulated arm diverged.

    Example:
        >>> simulated = didim.simulate(didim.Cell.read("tx40.toml"), "tx40-paper", seed=2)
        >>> simulated.recording.torque.shape, simulated.truth["fc1"]
    """
    with Call() as call:
        moves = call.write("motion.csv", motion._text) if isinstance(motion, Motion) else motion
        files = {"cell": call.cell(robot), "scenario": _scenario(call, scenario), "motion": moves}
        out = call.new("recording.csv")
        found = call.json("sim", seed=seed, out=out, **files, **options)
        with open(out, encoding="utf-8") as table:
            names = next(table).split(",")
            rows = np.loadtxt(table, delimiter=",", ndmin=2)
    blocks = [name for name in names if name.strip().endswith("_1")]
    recording = Recording(rows[:, 0], *np.split(rows[:, 1:], len(blocks), axis=1), side="motor")
    return Simulation(recording, {of["name"]: of["value"] for of in found["truth"]}, found)


def _scenario(call: Call, of: Mapping[str, Any] | _Path | None) -> _Path | None:
    """Returns the file or the name of a scenario."""
    return call.write("scenario.toml", toml(of)) if isinstance(of, Mapping) else of


@dataclass(frozen=True, repr=False)
class Motion:
    """A designed motion. Run it at 10 % speed first.

    Attributes:
        time: n times [s].
        position: n × joints [rad or m].
        velocity: n × joints [rad/s or m/s].
        acceleration: n × joints [rad/s² or m/s²].
        statement: The lines of the file's head: what was checked, what was not, and the limits that the motion uses.
        summary: The text of ``didim design``: expected standard deviations of the parameters.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    statement: list[str]
    summary: str
    _text: str = field(repr=False)

    @classmethod
    def _of(cls, text: str, summary: str) -> Motion:
        lines = text.splitlines()
        head = [line.removeprefix("#").strip() for line in lines if line.startswith("#")]
        rows = np.loadtxt(lines[len(head) + 1 :], delimiter=",", ndmin=2)
        position, velocity, acceleration = np.split(rows[:, 1:], 3, axis=1)
        return cls(rows[:, 0], position, velocity, acceleration, head, summary, text)

    def __repr__(self) -> str:
        rows, joints = self.position.shape
        return f"<didim.Motion: {self.time[-1]:g} s, {rows} rows of {joints} joints; {self.statement[1]}>"

    def save(self, path: _Path) -> None:
        """Writes the motion as a table (CSV), which ``didim sim --motion`` reads."""
        Path(path).write_text(self._text, encoding="utf-8")


def design(
    robot: Robot | Cell | _Path,
    duration: float,
    *,
    result: Result | _Path | None = None,
    out: _Path | Sequence[_Path] = (),
    declared_centre_m: Sequence[float] | None = None,
    **options: Any,
) -> Motion:
    """Designs a motion that makes the parameters well identifiable, as ``didim design``. Nothing moves.

    Args:
        robot: The robot, or a cell with the limits.
        duration: Length of the motion [s].
        result: A result of the same cell as prior knowledge.
        out: Files to write as well: ``.csv``, ``.yaml`` (ROS 2), ``.script`` (Universal Robots), ``.src`` (KUKA), ``.mod``
            (ABB).
        declared_centre_m: Expected centre of a load for ``objective="payload"``: 3 values [m].
        options: ``acceleration=5`` [rad/s²], ``steps=600``, ``joints="3,4"``, ``start=FILE``, ``preview=FILE``.

    Raises:
        ConfigurationError: A limit is unknown, or the shapes for a collision check cannot be read.
        UsageError: An option is unknown or its value impossible.
        IdentificationError: No motion within the limits was found.
    """
    others = [out] if isinstance(out, (str, PathLike)) else list(out)
    with Call() as call:
        table = call.new("motion.csv")
        files = {"cell": call.cell(robot), "result": None if result is None else call.result(result)}
        options = {"declared_centre_m": _point(declared_centre_m), **options}
        summary = call.run("design", duration=duration, out=[table, *others], **files, **options)
        return Motion._of(table.read_text(encoding="utf-8"), summary)


@dataclass(frozen=True, repr=False)
class Payload(Table):
    """A load on the last link.

    Values that the recording does not identify are ``None``.

    Attributes:
        present: True if a load is present: its mass exceeds three standard deviations.
        mass: Mass [kg].
        mass_limit_kg: The mass of a load that is not seen is below it with a probability of 95 % [kg].
        frame: Name of the frame of centre and inertia.
        centre: Centre of mass, 3 values [m].
        inertia: Inertia about the centre of mass: xx, xy, xz, yy, yz, zz [kg·m²]. xy is minus the integral of xy.
        parameters: Identifiable sums of the ten load parameters in this frame.
        relative_errors: ‖residuals‖ / ‖torque‖ without and with the load.
        findings: Findings on the declared load.
        data: The JSON object of ``didim payload --json``.
    """

    present: bool
    mass: UncertainValue | None
    mass_limit_kg: float | None
    frame: str
    centre: list[UncertainValue | None]
    inertia: list[UncertainValue | None]
    parameters: Parameters
    relative_errors: tuple[float, float]
    findings: list[Finding]
    data: dict[str, Any]

    @classmethod
    def _of(cls, found: dict[str, Any]) -> Payload:
        seen = found["presence"]
        load = found["centre_of_mass"] or {**found["load"], "frame": "", "parameters": found["parameters"]}
        centre, inertia = ([UncertainValue._of(of) for of in load[key]] for key in ("centre_m", "inertia_kg_m2"))
        errors = found["before"]["relative_error"], found["after"]["relative_error"]
        mass = UncertainValue._of(found["load"]["mass_kg"])
        parameters, findings = Parameters._of(load["parameters"]), _findings(found.get("findings", []))
        frame, limit = load["frame"], seen["mass_limit_kg"]
        return cls(seen["seen"], mass, limit, frame, centre, inertia, parameters, errors, findings, found)

    def _rows(self) -> _Rows:
        axes = [("centre " + axis, "m", of) for axis, of in zip("xyz", self.centre)]
        moments = zip(("xx", "xy", "xz", "yy", "yz", "zz"), self.inertia)
        values = [("mass", "kg", self.mass), *axes, *(("inertia " + name, "kg·m²", of) for name, of in moments)]
        cells = [
            [name, "not identified", unit, ""] if of is None else
            [name, digits(of.value, 4), unit, digits(of.standard_deviation)]
            for name, unit, of in values
        ]
        return [["load" if self.present else "load (not seen)", "value", "unit", "σ"], *cells]


def payload(
    result: Result | _Path,
    data: Recording | _Path,
    cell: Robot | Cell | _Path | None = None,
    *,
    declared_mass_kg: float | None = None,
    declared_centre_m: Sequence[float] | None = None,
    frame: str | None = None,
    start: float | None = None,
    end: float | None = None,
    **options: Any,
) -> Payload:
    """Identifies the load on the last link, as ``didim payload``.

    Args:
        result: The arm without the load.
        data: A recording with the load.
        cell: The cell of the result; needed for the file of a result.
        declared_mass_kg: Declared mass to compare with [kg].
        declared_centre_m: Its centre of mass, 3 values [m].
        frame: Link of the URDF in whose frame the load is given and returned.
        start: Start of the samples that count [s after the first].
        end: End of the samples that count [s after the first].

    Raises:
        DataError: The recording does not fit the robot, or does not identify a load.
        IdentificationError: The result has no covariance, or is not of this cell.
        UsageError: The frame is not fixed to the last link, or no cell is given.
    """
    found = result._cell if cell is None and isinstance(result, Result) else cell
    if found is None:
        found = Path("cell.toml")
    if isinstance(result, Result):
        options = {"joints": result._joints, **options}
    with Call() as call:
        recording = call.recording(data)
        files = {"result": call.result(result), "input": recording["file"], "sample_rate": recording["sample_rate"]}
        of = data if isinstance(data, Recording) else None
        options = {"from": start, "to": end, "frame": frame, "declared_mass_kg": declared_mass_kg, **options}
        centre = _point(declared_centre_m)
        return Payload._of(call.json("payload", cell=call.cell(found, of), declared_centre_m=centre, **files, **options))


@dataclass(frozen=True)
class DriveGain:
    """Torque gain of one drive.

    Attributes:
        joint: Number of its joint, from 1.
        unit: Unit of the gain.
        configured: Gain in the cell, without its sign.
        found: Identified gain; ``None`` if it is not identifiable.
        cell_line: Line for ``[[bus.drives]]`` of the cell file.
    """

    joint: int
    unit: str
    configured: float
    found: UncertainValue | None
    cell_line: str | None


@dataclass(frozen=True, repr=False)
class Gains(Table):
    """Torque gains of the drives.

    Attributes:
        gains: One gain per drive.
        parameters: Base parameters of the arm without a load, with these gains.
        findings: Findings on the load.
        data: The JSON object of ``didim gains --json``.
    """

    gains: list[DriveGain]
    parameters: Parameters
    findings: list[Finding]
    data: dict[str, Any]

    def _rows(self) -> _Rows:
        cells = [
            [str(of.joint), f"{of.configured:.6g}", str(of.found or "not identified"), of.unit] for of in self.gains
        ]
        return [["joint", "configured", "found", "unit"], *cells]


def gains(
    cell: Robot | Cell | _Path,
    data: Recording | _Path,
    loaded: Recording | _Path | None = None,
    *,
    declared_mass_kg: float | None = None,
    declared_centre_m: Sequence[float] | None = None,
    frame: str | None = None,
    start: float | None = None,
    end: float | None = None,
    **options: Any,
) -> Gains:
    """Identifies the torque gains of the drives from recordings with and without a known load, as ``didim gains``.

    Args:
        cell: The cell.
        data: A recording without the load.
        loaded: A recording with the load. Without one, the gains are in units of one drive's.
        declared_mass_kg: Mass of the load, weighed [kg].
        declared_centre_m: Its centre of mass, 3 values [m].
        frame: Link of the URDF in whose frame the centre is given.
        start: Start of the samples that count [s after the first].
        end: End of the samples that count [s after the first].

    Raises:
        DataError: A recording cannot be read, or does not fit the robot.
        IdentificationError: The recordings do not identify the gains.
        UsageError: A load is given without its mass or centre.
    """
    with Call() as call:
        empty = call.recording(data)
        load = {} if loaded is None else call.recording(loaded, "loaded")
        files = {"input": empty["file"], "loaded": load.get("file"), "sample_rate": empty["sample_rate"]}
        of = data if isinstance(data, Recording) else None
        options = {"from": start, "to": end, "frame": frame, "declared_mass_kg": declared_mass_kg, **options}
        centre = _point(declared_centre_m)
        found = call.json("gains", cell=call.cell(cell, of), declared_centre_m=centre, **files, **options)
    drives = [
        DriveGain(of["joint"], of["unit"], of["stated"], UncertainValue._of(of["found"]), of["cell_line"])
        for of in found["gains"]
    ]
    return Gains(drives, Parameters._of(found["parameters"]), _findings(found.get("findings", [])), found)


@dataclass(frozen=True)
class MethodResult:
    """The result of one method.

    Attributes:
        method: Its name.
        framework: ``decimated``, or ``strict`` without the decimation filter.
        parameters: The estimates; empty if the method failed.
        relative_error: ‖y − Xθ‖ / ‖y‖; ``None`` if the method failed.
        failure: Reason why there is no result.
    """

    method: str
    framework: str
    parameters: Parameters
    relative_error: float | None
    failure: str | None


@dataclass(frozen=True, repr=False)
class Comparison(Table):
    """Methods on one experiment.

    Attributes:
        methods: The results, the reference first.
        held_out_errors: Relative error of each method on samples that were held out.
        truth: True parameters by name, in SI units, if the arm is simulated.
        data: The JSON object of ``didim compare --json``.
    """

    methods: list[MethodResult]
    held_out_errors: dict[str, float]
    truth: dict[str, float] | None
    data: dict[str, Any]

    @classmethod
    def _of(cls, found: dict[str, Any]) -> Comparison:
        methods = []
        for of in found["methods"]:
            estimate = of["estimate"] or {"parameters": [], "relative_error": None}
            values = Parameters._of(estimate["parameters"]), estimate["relative_error"], of["failure"]
            methods.append(MethodResult(of["method"], of["framework"], *values))
        held_out = {of["method"]: of["held_out"] for of in found["held_out"]}
        errors = {method: of["relative_error"] for method, of in held_out.items() if of is not None}
        truth = found["truth"] and {of["name"]: of["value"] for of in found["truth"]}
        return cls(methods, errors, truth, found)

    def to_frame(self) -> pd.DataFrame:
        """Returns values and standard deviations as a :class:`pandas.DataFrame`: a row per parameter, columns per method."""
        pandas = optional("pandas", "frame")

        def name(of: MethodResult) -> str:
            return of.method if of.framework == "decimated" else f"{of.method} ({of.framework})"

        frames = {name(of): of.parameters.to_frame() for of in self.methods if of.failure is None}
        frame: pd.DataFrame = pandas.concat(frames, axis=1)
        return frame

    def _rows(self) -> _Rows:
        cells = [
            [of.method, of.framework, "–" if of.failure else f"{100.0 * number(of.relative_error):.2f} %",
             f"{100.0 * self.held_out_errors.get(of.method, float('nan')):.2f} %", of.failure or ""]
            for of in self.methods
        ]
        return [["method", "framework", "error", "error held out", "failure"], *cells]


def compare(
    cell: Robot | Cell | _Path,
    data: Recording | _Path | None = None,
    *,
    scenario: Mapping[str, Any] | _Path | None = None,
    methods: Sequence[str] = (),
    folds: int = 5,
    start: float | None = None,
    end: float | None = None,
    **options: Any,
) -> Comparison:
    """Compares methods on one experiment, as ``didim compare``.

    Args:
        cell: The cell; its controller is needed by methods that simulate.
        data: The recording. Of several pieces, the longest counts.
        scenario: A simulated experiment in place of a recording, as :func:`simulate` takes it.
        methods: Their names; all if left out. ``"idim-ls"``, the reference, always runs.
        folds: Blocks of samples for the cross-validation; 0 for none.
        start: Start of the samples that count [s after the first].
        end: End of the samples that count [s after the first].

    Raises:
        ConfigurationError: A named method needs a controller, which the cell has not.
        DataError: The recording does not fit the robot.
        IdentificationError: No method has a result.
        UsageError: Neither a recording nor a scenario is given, or a method is unknown.
    """
    with Call() as call:
        files: dict[str, Any] = {}
        if data is not None:
            recording = call.recording(data)
            files = {"input": recording["file"], "sample_rate": recording["sample_rate"]}
        options = {"from": start, "to": end, "methods": ",".join(methods) or None, "folds": folds, **options}
        rate = data if isinstance(data, Recording) else None
        return Comparison._of(call.json("compare", cell=call.cell(cell, rate), scenario=_scenario(call, scenario), **files, **options))


@dataclass(frozen=True, repr=False)
class History(Table):
    """Results of one arm over time.

    Attributes:
        results: The results, oldest first: keys as in ``history.jsonl``, and the parameters ``outside`` their bands.
        alarms: Raised alarms.
        trends: Trends of the parameters, in SI units per day.
        data: The JSON object of ``didim history --json``.
    """

    results: list[dict[str, Any]]
    alarms: list[dict[str, Any]]
    trends: list[dict[str, Any]]
    data: dict[str, Any]

    def to_frame(self) -> pd.DataFrame:
        """Returns a :class:`pandas.DataFrame` with a row for each parameter of each result."""
        pandas = optional("pandas", "frame")

        rows = [
            {
                "time": of["time"],
                "result": of["result"],
                "parameter": parameter["name"],
                "unit": parameter.get("unit", ""),
                "value": number(parameter["value"]),
                "standard_deviation": number(parameter["standard_deviation"]),
                "combined_standard_deviation": number(parameter.get("combined_standard_deviation")),
                "outside": parameter["name"] in of["outside"],
            }
            for of in self.results
            for parameter in of["parameters"]
        ]
        frame: pd.DataFrame = pandas.DataFrame(rows)
        frame["time"] = pandas.to_datetime(frame["time"])
        return frame

    def _rows(self) -> _Rows:
        cells = [
            [str(of["result"]), of["time"], of["method"], f"{100.0 * number(of['relative_error']):.2f} %",
             ", ".join(of["outside"])]
            for of in self.results
        ]
        return [["result", "time", "method", "error", "outside"], *cells]


def history(state: _Path, **options: Any) -> History:
    """Returns the results in a folder over time, compared with the baseline, as ``didim history``.

    Args:
        state: The folder of results.
        options: ``last=10``, ``parameter="fv1"``.

    Raises:
        IdentificationError: The folder has no history that can be read.
    """
    with Call() as call:
        found = call.json("history", state=state, **options)
    return History(found["results"], found["alarms"], found["trends"], found)


@dataclass(frozen=True, repr=False)
class Fleet(Table):
    """Arms of one type.

    Attributes:
        arms: Names of the arms.
        parameters: Per parameter: ``name``, ``unit``, ``median``, ``scatter``, ``limit``, and its ``arms``.
        data: The JSON object of ``didim fleet --json``.
    """

    arms: list[str]
    parameters: list[dict[str, Any]]
    data: dict[str, Any]

    def to_frame(self) -> pd.DataFrame:
        """Returns a :class:`pandas.DataFrame` with a row for each parameter of each arm."""
        pandas = optional("pandas", "frame")

        rows = (
            {
                "arm": of["arm"],
                "parameter": parameter["name"],
                "unit": parameter["unit"],
                "value": number(of["value"]),
                "combined_standard_deviation": number(of["combined_standard_deviation"]),
                "median": parameter["median"],
                "scatter": parameter["scatter"],
                "deviation": number(of["deviation"]),
                "outside": abs(number(of["deviation"])) > parameter["limit"],
            }
            for parameter in self.parameters
            for of in parameter["arms"]
        )
        frame: pd.DataFrame = pandas.DataFrame(rows)
        return frame

    def _rows(self) -> _Rows:
        cells = [
            [of["name"], f"{of['median']:.4g}", of["unit"], digits(of["scatter"]),
             ", ".join(arm["arm"] for arm in of["arms"] if abs(number(arm["deviation"])) > of["limit"])]
            for of in self.parameters
        ]
        return [["parameter", "median", "unit", "scatter", "outside"], *cells]


def fleet(*histories: _Path) -> Fleet:
    """Compares arms of one type by their histories, as ``didim fleet``.

    Args:
        histories: One per arm: a folder of results, or a table of ``didim history --out``.

    Raises:
        IdentificationError: A history cannot be read, or the arms are not of one type.
        UsageError: No history is given.
    """
    with Call() as call:
        files = [Path(of) for of in histories]
        for place, folder in enumerate(files):
            if folder.is_dir():
                # Arms without a name of their own are called by their files.
                name = "-".join(folder.absolute().parts[1:]) + ".csv"
                files[place] = call.new(name, str(folder))
                call.run("history", state=folder, out=files[place])
        found = call.json("fleet", *files)
    return Fleet([of["arm"] for of in found["arms"]], found["parameters"], found)
