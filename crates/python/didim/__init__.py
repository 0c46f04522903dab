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
from .cell import BaseParameter, Cell, Robot
from .program import (
    NotUsable,
    check,
    compare,
    design,
    fleet,
    gains,
    history,
    payload,
    run,
    simulate,
)
from .recording import Recording, read
from .result import (
    Finding,
    Parameter,
    Parameters,
    Prediction,
    Result,
    UseVerdict,
    Verdict,
    identify,
)

__all__ = [
    "BaseParameter",
    "Cell",
    "ConfigurationError",
    "DataError",
    "Error",
    "Finding",
    "IdentificationError",
    "NotUsable",
    "Parameter",
    "Parameters",
    "Prediction",
    "Recording",
    "Result",
    "Robot",
    "UsageError",
    "UseVerdict",
    "Verdict",
    "__version__",
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
