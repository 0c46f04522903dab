"""Robots, and cells: a robot with the layout of its recordings and the settings of its identification."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import ConfigurationError, UsageError

#: Friction terms that :meth:`Robot.from_urdf` knows by name.
FRICTION_TERMS = ("viscous", "coulomb", "offset")

#: Sample rate of a cell that has no recording yet [Hz]. Nothing of the robot depends on it.
_ANY_RATE = 1000.0


@dataclass(frozen=True)
class BaseParameter:
    """A base parameter: a sum of standard parameters that the torques can tell apart.

    Attributes:
        name: That of the standard parameter that gives the column, with an ``r`` if others are regrouped into it.
        expression: The sum, for example ``zz1 + ia1 + yy2``.
    """

    name: str
    expression: str


def _rows(array: ArrayLike) -> NDArray[np.float64]:
    """Returns an array with one row per sample; a single row may be given without its dimension."""
    return np.atleast_2d(np.asarray(array, dtype=np.float64))


class _Dynamics:
    """The robot of a cell, and its dynamics."""

    _native: _native.Cell

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints in the robot's file, or their numbers."""
        return self._native.joint_names

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self._native.joint_names)

    @property
    def parameter_names(self) -> list[str]:
        """Names of the standard parameters, in the order of the regressor's columns."""
        return self._native.parameter_names

    @property
    def notes(self) -> list[str]:
        """Notes on the robot's URDF, for example lengths that were rounded to zero."""
        return self._native.notes

    def base_parameters(self) -> list[BaseParameter]:
        """Returns the base parameters in the order of the standard parameters that give their columns."""
        return [BaseParameter(*of) for of in self._native.base_parameters()]

    def nominal_parameters(self) -> NDArray[np.float64] | None:
        """Returns the standard parameters of the robot's file; ``None`` if a link has no body."""
        values = self._native.nominal_parameters()
        return None if values is None else np.array(values)

    def to_base(self, standard: ArrayLike) -> NDArray[np.float64]:
        """Returns the base values of standard values.

        Args:
            standard: p values in SI units, ordered as :attr:`parameter_names`.
        """
        return np.array(self._native.to_base(np.atleast_1d(np.asarray(standard, dtype=np.float64))))

    def regressor(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, *, base: bool = False) -> NDArray[np.float64]:
        """Returns the matrix Y(q, q̇, q̈) with τ = Y φ for each sample.

        Args:
            q: Positions, n × joints [rad or m].
            dq: Speeds, n × joints.
            ddq: Accelerations, n × joints.
            base: Return the columns of the base parameters only.

        Returns:
            n × joints × p.

        Raises:
            UsageError: A shape is not n × joints.
        """
        whole = self._native.regressor(_rows(q), _rows(dq), _rows(ddq))
        return whole[:, :, self._native.base_columns()] if base else whole

    def inverse_dynamics(
        self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, parameters: ArrayLike | None = None
    ) -> NDArray[np.float64]:
        """Returns the joint torques for a motion, with friction and drive inertias.

        Args:
            q: Positions, n × joints [rad or m].
            dq: Speeds, n × joints.
            ddq: Accelerations, n × joints.
            parameters: Standard or base parameters in SI units; those of the robot's file if left out.

        Returns:
            Torques, n × joints [N·m or N].

        Raises:
            UsageError: A shape does not fit, or the robot's file has no bodies and no parameters are given.
        """
        return self._native.inverse_dynamics(_rows(q), _rows(dq), _rows(ddq), self._values(parameters))

    def mass_matrix(self, q: ArrayLike, parameters: ArrayLike | None = None) -> NDArray[np.float64]:
        """Returns the mass matrix of each posture, n × joints × joints.

        Args:
            q: Positions, n × joints [rad or m].
            parameters: As in :meth:`inverse_dynamics`.
        """
        return self._native.mass_matrix(_rows(q), self._values(parameters))

    def _values(self, parameters: ArrayLike | None) -> NDArray[np.float64]:
        if parameters is not None:
            return np.asarray(parameters, dtype=np.float64)
        nominal = self.nominal_parameters()
        if nominal is None:
            raise UsageError("the robot's file has no bodies; give the parameters")
        return nominal


class Robot(_Dynamics):
    """A robot: its geometry, its drives and its friction.

    Create one by :meth:`from_urdf` or :meth:`from_file`.
    """

    def __init__(self, path: str | PathLike[str], urdf: dict[str, Any] | None) -> None:
        self._file = os.path.abspath(path)
        self._text = _text(path)
        self._urdf = urdf
        self._native = self._any_cell()._native

    def __repr__(self) -> str:
        return f"<didim.Robot {self.name}: {', '.join(self.joint_names)}>"

    @property
    def name(self) -> str:
        """Name of the robot in its file."""
        return self._native.robot

    @classmethod
    def from_urdf(
        cls,
        path: str | PathLike[str],
        *,
        drive_inertia: bool,
        friction: Sequence[str] | Mapping[str, Any],
        gear_ratios: Sequence[float] | None = None,
        base: str | None = None,
        tip: str | None = None,
        gravity: Sequence[float] | None = None,
        joints: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> Robot:
        """Reads a URDF.

        Args:
            path: The file.
            drive_inertia: True if torque comes from motor current, so that the inertias of the drives are parameters.
                False if joint torque sensors measure it.
            friction: Terms ``"viscous"``, ``"coulomb"``, ``"offset"``, or the keys of ``[friction]`` in a robot file. The
                sign of a speed v is tanh(v / 0.02 rad/s) unless the keys say otherwise.
            gear_ratios: Motor turns per joint turn, one per joint; needed for recordings of the motor side.
            base: The link on which the arm stands; the root of the URDF if left out.
            tip: The link at which the arm ends; the end of the URDF if left out.
            gravity: Gravity in the frame of ``base`` [m/s²]; ``[0, 0, -9.81]`` if left out.
            joints: Properties of single joints by their names, as ``[urdf.joints]`` of a cell file.

        Raises:
            ConfigurationError: The file cannot be read, or describes no chain of joints.
            UsageError: A friction term is unknown.
        """
        urdf: dict[str, Any] = {"drive_inertia": drive_inertia, "friction": _friction_keys(friction)}
        chosen = {"gear_ratios": gear_ratios, "base": base, "tip": tip, "gravity_m_s2": gravity, "joints": joints}
        urdf.update({key: value for key, value in chosen.items() if value is not None})
        if gear_ratios is None:
            urdf["gear_ratios"] = _ones(path, urdf)
        return cls(path, urdf)

    @classmethod
    def from_file(cls, path: str | PathLike[str]) -> Robot:
        """Reads a robot file (``didim-robot(5)``).

        Raises:
            ConfigurationError: The file cannot be read, or a key is wrong.
        """
        return cls(path, None)

    def cell(self, sample_rate: float, **identification: Any) -> Cell:
        """Returns a cell for recordings of this robot: measured torques of its joints, without a bus.

        Args:
            sample_rate: Samples per second of the recordings [Hz].
            identification: Keys of ``[identification]`` in a cell file. Those left out are: method ``"idim-ls"``, a
                position filter whose cut-off the data choose, and a row per ten samples or 25 rows a second.
        """
        settings = {
            "method": "idim-ls",
            "position_filter": {"cutoff_hz": "auto"},
            "decimation_filter": {"factor": int(_native.Cell.usual_samples_per_row(sample_rate))},
            **identification,
        }
        sections: dict[str, Any] = {
            "name": "python",
            "robot": self._file,
            "data": {"rate_hz": sample_rate, "torque_valid": "instant"},
            "identification": settings,
        }
        if self._urdf is not None:
            sections["urdf"] = self._urdf
        text = json.dumps(sections)
        return Cell(_native.Cell.from_json(text, self._file, self._text), text=_native.Cell.toml(text))

    def _any_cell(self) -> Cell:
        """Returns a cell for work without a recording, for example to design a motion."""
        return self.cell(_ANY_RATE)


class Cell(_Dynamics):
    """A robot with the layout of its recordings and the settings of its identification: the content of a cell file."""

    def __init__(self, native: _native.Cell, *, file: Path | None = None, text: str = "") -> None:
        self._native = native
        self._file = file
        self._text = text

    def __repr__(self) -> str:
        return f"<didim.Cell {self.name}: {self._native.robot}, {self.sample_rate:g} Hz, {self.method}>"

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Cell:
        """Reads a cell file and every file that it names.

        Raises:
            ConfigurationError: A file cannot be read, or a key is wrong. The message names file, line and key.
        """
        return cls(_native.Cell.read(fspath(path)), file=Path(path).absolute())

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the cell file of a robot's cell for the program. It names the robot's file.

        Raises:
            UsageError: The cell was read from a file, which may name others.
        """
        if self._file is not None:
            raise UsageError(f"the cell is that of {self._file}; use this file")
        Path(path).write_text(self._text, encoding="utf-8")

    @property
    def name(self) -> str:
        """Name of the cell."""
        return self._native.name

    @property
    def configuration(self) -> str:
        """SHA-256 of the cell and of every file that it names."""
        return self._native.configuration

    @property
    def sample_rate(self) -> float:
        """Samples per second of its recordings [Hz]."""
        return self._native.sample_rate

    @property
    def method(self) -> str:
        """Name of the method."""
        return self._native.method


def _friction_keys(friction: Sequence[str] | Mapping[str, Any]) -> dict[str, Any]:
    """Returns the keys of ``[friction]`` in a robot file."""
    if isinstance(friction, Mapping):
        return dict(friction)
    friction = [friction] if isinstance(friction, str) else friction
    unknown = [term for term in friction if term not in FRICTION_TERMS]
    if unknown:
        raise UsageError(f"friction term `{unknown[0]}` is unknown; known: {', '.join(FRICTION_TERMS)}")
    terms: dict[str, Any] = {term: term in friction for term in FRICTION_TERMS}
    if "coulomb" in friction:
        terms["sign"] = {"model": "tanh", "width_rad_s": 0.02}
    return terms


def _text(path: str | PathLike[str]) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{fspath(path)}: {error}") from error


def _ones(path: str | PathLike[str], urdf: dict[str, Any]) -> list[float]:
    """Returns a gear ratio of 1 for each joint of the arm: all signals are on the joint side."""
    return [1.0] * _native.Cell.urdf_joints(_text(path), Path(path).name, urdf.get("base"), urdf.get("tip"))
