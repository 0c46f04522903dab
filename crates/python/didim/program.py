"""The commands of the program ``didim`` as functions."""

from __future__ import annotations

import json
import shutil
import subprocess
import sysconfig
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ._native import ConfigurationError, Error, IdentificationError, UsageError


class NotUsable(Error):
    """The work was done, and its result does not meet a requirement. ``data`` is the output."""

    def __init__(self, message: str, data: Any) -> None:
        super().__init__(message)
        self.data = data


#: Exception of each exit code; 3 is :class:`NotUsable`, 130 :class:`KeyboardInterrupt`.
_EXCEPTIONS: dict[int, type[Error]] = {1: IdentificationError, 2: UsageError, 78: ConfigurationError}


def _program() -> str:
    installed = Path(sysconfig.get_path("scripts")) / "didim"
    found = str(installed) if installed.exists() else shutil.which("didim")
    if found is None:
        raise Error("the program `didim` is not installed; install the package again")
    return found


def _arguments(options: dict[str, Any]) -> list[str]:
    """Returns the options of a command line: ``keep_going=True`` is ``--keep-going``."""
    arguments = []
    for key, value in options.items():
        name = "--" + key.rstrip("_").replace("_", "-")
        if value is None or value is False:
            continue
        values = value if isinstance(value, (list, tuple)) else [value]
        for one in values:
            arguments.append(name)
            if one is not True:
                arguments.append(fspath(one) if isinstance(one, PathLike) else str(one))
    return arguments


def run(command: str, *positional: str | PathLike[str], **options: Any) -> str:
    """Runs a command of ``didim`` and returns what it prints.

    Args:
        command: For example ``"check"``; several words as ``"baseline set"``.
        positional: Arguments without a name.
        options: Options by name: ``keep_going=True`` is ``--keep-going``, a list repeats an option.

    Raises:
        UsageError: An argument is wrong (exit code 2).
        ConfigurationError: A cell, robot or layout is wrong (78).
        IdentificationError: The work failed (1).
        NotUsable: The result does not meet a requirement (3).

    Example:
        >>> didim.run("baseline set", state="results")
    """
    words = [fspath(word) for word in positional]
    line = [_program(), *command.split(), *words, *_arguments(options)]
    done = subprocess.run(line, capture_output=True, text=True, encoding="utf-8")
    if done.returncode == 0:
        return done.stdout
    message = done.stderr.strip().removeprefix("didim: ")
    if done.returncode == 3:
        raise NotUsable(message, done.stdout)
    if done.returncode == 130:
        raise KeyboardInterrupt
    raise _EXCEPTIONS.get(done.returncode, Error)(message)


def _json(command: str, *positional: str | PathLike[str], **options: Any) -> Any:
    return json.loads(run(command, *positional, json=True, **options))


def check(cell: str | PathLike[str], **options: Any) -> Any:
    """Checks a cell file, as ``didim check``; the findings as a dictionary."""
    return _json("check", cell=cell, **options)


def compare(cell: str | PathLike[str], **options: Any) -> Any:
    """Compares methods on one experiment, as ``didim compare``: ``input=`` or ``scenario=``, ``methods=``."""
    return _json("compare", cell=cell, **options)


def design(out: str | PathLike[str], **options: Any) -> str:
    """Designs a motion that makes the parameters well identifiable, as ``didim design``; returns the summary."""
    return run("design", out=out, **options)


def fleet(*histories: str | PathLike[str], **options: Any) -> Any:
    """Compares arms of one type by their histories, as ``didim fleet``."""
    return _json("fleet", *histories, **options)


def gains(**options: Any) -> Any:
    """Finds the torque gains of the drives from recordings with and without a known load, as ``didim gains``."""
    return _json("gains", **options)


def history(state: str | PathLike[str], **options: Any) -> Any:
    """Returns the results in a folder over time, compared with the baseline, as ``didim history``."""
    return _json("history", state=state, **options)


def payload(result: str | PathLike[str], input: str | PathLike[str], **options: Any) -> Any:
    """Identifies the load on the flange, as ``didim payload``: ``cell=`` names the cell file."""
    return _json("payload", result=result, input=input, **options)


def simulate(bus: str, **options: Any) -> str:
    """Puts a simulated arm on a bus or into a log, as ``didim sim``: ``bus="log:arm.log"``."""
    return run("sim", bus=bus, **options)
