"""The program ``didim``: one run of a command, with objects in place of files."""

from __future__ import annotations

import json
import logging
import re
import shutil
import subprocess
import sysconfig
from collections.abc import Callable, Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any

from ._native import Cell as NativeCell
from ._native import ConfigurationError, DataError, Error, IdentificationError, UsageError, in_python
from .cell import Cell, Robot
from .recording import Recording
from .result import Result

_LOGGER = logging.getLogger("didim")


class NotUsable(Error):
    """The work was done, and its result does not meet a requirement.

    Attributes:
        data: The output of the command.
    """

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


def _arguments(options: Mapping[str, Any]) -> list[str]:
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


#: A line of the program's log: its time, its level and its message.
_LOG_LINE = re.compile(r"\d{4}-\d\d-\d\dT\S+Z\s+(?P<level>ERROR|WARN|INFO|DEBUG|TRACE)\s+(?P<message>.*)")

_LEVELS = {"ERROR": logging.ERROR, "WARN": logging.WARNING, "INFO": logging.INFO}


def _log(notes: str) -> None:
    """Passes the notes of a run that succeeded on to the logger."""
    for note in filter(str.strip, notes.splitlines()):
        logged = _LOG_LINE.match(note)
        if logged:
            _LOGGER.log(_LEVELS.get(logged["level"], logging.DEBUG), logged["message"])
        else:
            is_hint = note.startswith("next: ")
            _LOGGER.log(logging.INFO if is_hint else logging.WARNING, note.removeprefix("note: "))


def run(command: str, *positional: str | PathLike[str], **options: Any) -> str:
    """Runs a command of ``didim`` and returns what it prints. Its notes go to the logger ``didim``.

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
    return _run(command, positional, options, str)


def _run(
    command: str,
    positional: Sequence[str | PathLike[str]],
    options: Mapping[str, Any],
    rename: Callable[[str], str],
) -> str:
    """Runs a command; notes and messages are renamed."""
    words = [fspath(word) for word in positional]
    line = [_program(), *command.split(), *words, *_arguments(options)]
    done = subprocess.run(line, capture_output=True, text=True, encoding="utf-8")
    if done.returncode == 0:
        _log(rename(done.stderr))
        return done.stdout
    message = done.stderr.strip().removeprefix("didim: ").removeprefix("error: ")
    if done.returncode == 3:
        raise NotUsable(message, done.stdout)
    if done.returncode == 130:
        raise KeyboardInterrupt
    raise _EXCEPTIONS.get(done.returncode, Error)(message)


def toml(keys: Mapping[str, Any]) -> str:
    """Returns the text of a file with these keys."""
    return NativeCell.toml(json.dumps(keys))


class Call:
    """A run of a command whose arguments are objects: files for those in memory stand in a temporary folder, which is
    removed at the end. Messages name the argument in place of its file.
    """

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="didim-")
        self._names: dict[str, str] = {}
        self._recordings: list[str] = []

    def __enter__(self) -> Call:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._folder.cleanup()

    def new(self, name: str, argument: str | None = None) -> Path:
        """Returns the path of a new file, which messages call by the name of an argument."""
        path = Path(self._folder.name) / name
        self._names[str(path)] = argument or Path(name).stem
        return path

    def cell(self, of: Robot | Cell | str | PathLike[str], data: Recording | None = None) -> Path:
        """Returns the cell file of a robot or a cell; the rate of a robot's cell is that of a recording."""
        if isinstance(of, Robot):
            of = of.cell(data.sample_rate) if data else of._any_cell()
        if not isinstance(of, Cell):
            return Path(of)
        if of._file is not None:
            return of._file
        return self.write("cell.toml", of._text)

    def recording(self, of: Recording | str | PathLike[str], argument: str = "data") -> dict[str, Any]:
        """Returns the options for a recording: its file and, for a table without times, the sample rate."""
        rate = None
        if not isinstance(of, Recording):
            path = Path(of)
        elif of._file is None:
            path = self.new(f"{argument}.csv", argument)
            of.save(path)
        else:
            path, rate = Path(of._file[0]), of._file[1]
        self._recordings.append(str(path))
        return {"file": path, "sample_rate": rate}

    def result(self, of: Result | str | PathLike[str]) -> Path:
        """Returns the file of a result."""
        if not isinstance(of, Result):
            return Path(of)
        path = self.new("result.json", "result")
        of.save(path)
        return path

    def write(self, name: str, text: str) -> Path:
        """Writes a new file."""
        path = self.new(name)
        path.write_text(text, encoding="utf-8")
        return path

    def run(self, command: str, *positional: Path, **options: Any) -> str:
        """Runs the command as :func:`run`. A failure at a recording is a :class:`DataError`."""
        try:
            return _run(command, positional, options, self._rename)
        except NotUsable as error:
            raise NotUsable(self._message(error), error.data) from None
        except IdentificationError as error:
            is_of_data = str(error).startswith(tuple(f"{path}: " for path in self._recordings))
            raise (DataError if is_of_data else IdentificationError)(self._message(error)) from None
        except Error as error:
            raise type(error)(self._message(error)) from None

    def _rename(self, text: str) -> str:
        """Returns a text with the names of arguments in place of temporary files and options."""
        for path, name in self._names.items():
            text = text.replace(path, name)
        return in_python(text)

    def _message(self, error: Error) -> str:
        return self._rename(str(error).split("\n\nUsage: ")[0])

    def json(self, command: str, *positional: Path, **options: Any) -> Any:
        """Runs the command and returns its JSON object."""
        return json.loads(self.run(command, *positional, json=True, **options))
