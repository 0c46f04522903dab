"""Identify a robot's dynamic parameters, with their uncertainty, from its recorded motion.

Units are SI throughout: rad or m, N·m or N, s. Arrays have one row per sample and one column per joint.

    import didim

    robot = didim.Robot.from_urdf("arm.urdf", drive_inertia=True, friction=["viscous", "coulomb", "offset"])
    data = didim.Recording(time, position, torque)
    result = didim.identify(robot, data)
    print(result.parameters)
    print(result.verdict.prediction.usable)

Log messages go to the logger ``didim``.
"""

from ._native import ConfigurationError, DataError, Error, IdentificationError, UsageError, __version__
from .batches import Batch, Output, Task, batch
from .cell import BaseParameter, Cell, Robot
from .commands import (
    Comparison,
    DriveGain,
    Fleet,
    Gains,
    History,
    MethodResult,
    Motion,
    Payload,
    Simulation,
    check,
    compare,
    design,
    fleet,
    gains,
    history,
    payload,
    simulate,
)
from .program import NotUsable, run
from .recording import Recording, read
from .result import ExportedModel, Finding, Prediction, Result, UseVerdict, Verdict, identify
from .table import Parameter, Parameters, UncertainValue

__all__ = [
    "BaseParameter",
    "Batch",
    "Cell",
    "Comparison",
    "ConfigurationError",
    "DataError",
    "DriveGain",
    "Error",
    "ExportedModel",
    "Finding",
    "Fleet",
    "Gains",
    "History",
    "IdentificationError",
    "MethodResult",
    "Motion",
    "NotUsable",
    "Output",
    "Parameter",
    "Parameters",
    "Payload",
    "Prediction",
    "Recording",
    "Result",
    "Robot",
    "Simulation",
    "Task",
    "UncertainValue",
    "UsageError",
    "UseVerdict",
    "Verdict",
    "__version__",
    "batch",
    "check",
    "compare",
    "design",
    "fleet",
    "gains",
    "history",
    "identify",
    "payload",
    "read",
    "run",
    "simulate",
]
