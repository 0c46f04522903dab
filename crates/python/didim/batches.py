"""Many recordings, over any engine that maps a function: one output each, named by its input."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Literal

from . import _native
from ._native import ConfigurationError, DataError, Error, UsageError
from .cell import Cell
from .recording import read
from .result import identify
from .table import number, optional

_LOGGER = logging.getLogger("didim")
_Path = str | PathLike[str]
#: Seconds between two messages about progress.
_PROGRESS_S = 10.0
#: Bytes that are read at a time.
_BLOCK = 1 << 20
#: Name of the day of recordings without a date.
_NO_DAY = "unknown"


@dataclass(frozen=True)
class Task:
    """A recording to identify: paths that every worker can read. It can be pickled.

    Attributes:
        file: The recording.
        cell: Its cell file.
        configuration: SHA-256 of the cell and every file that it names.
        out: The folder of the outputs.
    """

    file: str
    cell: str
    configuration: str
    out: str


@dataclass(frozen=True)
class Output:
    """The outcome of one recording.

    Attributes:
        file: The recording.
        cell: Its cell file.
        path: The output. Empty for a recording that was refused.
        state: ``"computed"``, ``"there"`` if an earlier call computed it, or ``"refused"``.
        why: Why the recording was refused.
    """

    file: str
    cell: str
    path: str
    state: Literal["computed", "there", "refused"]
    why: str | None = None


class Batch(list[Output]):
    """The outcomes of a batch, in the order of its files.

    Attributes:
        out: The folder of the outputs, with those of earlier calls.
    """

    def __init__(self, out: Path) -> None:
        super().__init__()
        self.out = out

    def __repr__(self) -> str:
        counts = Counter(of.state for of in self)
        return f"<didim.Batch of {len(self)}: {', '.join(f'{count} {state}' for state, count in counts.items())}>"

    @property
    def refused(self) -> list[Output]:
        """The recordings without a result, each with the reason."""
        return [of for of in self if of.state == "refused"]

    def results(self) -> Iterator[dict[str, Any]]:
        """Reads the results of the folder one after another, with those of earlier calls: the JSON object of ``didim
        identify``, with ``input``."""
        for path in self._outputs():
            yield _result(path)

    def to_parquet(self, folder: _Path) -> None:
        """Writes a Parquet data set of all results of the folder, with a row for each parameter, in folders by arm and day:
        ``arm=NAME/day=2026-11-30``. The arm is the name of the cell.

        Folders of the same arm and day are replaced, so that a data set belongs to one folder of results. Columns are those of
        ``didim history --out`` that a recording has. The results of one day of an arm are in memory at a time.

        Raises:
            ImportError: pyarrow is not installed.
        """
        arrow, dataset = optional("pyarrow", "parquet"), optional("pyarrow.dataset", "parquet")
        schema = arrow.schema(
            [(name, arrow.string()) for name in _TEXTS]
            + [(name, arrow.float64()) for name in _NUMBERS]
            + [(name, arrow.bool_()) for name in _USES]
        )
        partitioning = dataset.partitioning(arrow.schema([("arm", arrow.string()), ("day", arrow.string())]), flavor="hive")
        for paths in self._days():
            rows = [row for path in paths for row in _rows(_result(path))]
            dataset.write_dataset(
                arrow.Table.from_pylist(rows, schema=schema),
                fspath(folder),
                format="parquet",
                partitioning=partitioning,
                existing_data_behavior="delete_matching",
            )

    def _days(self) -> Iterator[list[Path]]:
        """Returns the outputs of each arm and day, in the order of their recordings."""
        days: dict[tuple[str, str], list[tuple[str, str, Path]]] = {}
        for path in self._outputs():
            source = _result(path)["input"]
            recorded = source["recorded"] or ""
            days.setdefault((source["cell"], recorded[:10]), []).append((recorded, source["sha256"], path))
        for outputs in days.values():
            yield [path for *_, path in sorted(outputs)]

    def _outputs(self) -> list[Path]:
        return sorted(self.out.glob("[0-9a-f]*.json"))


_TEXTS = ["arm", "day", "input", "recorded", "robot", "method", "configuration", "parameter", "unit"]
_NUMBERS = ["value", "standard_deviation", "combined_standard_deviation", "relative_error"]
_USES = ["monitoring", "prediction", "contact_detection", "physical_values", "rigid_body"]


def _result(path: Path) -> dict[str, Any]:
    result: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return result


def _rows(result: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Returns a row of the data set for each parameter of a result."""
    source, uses = result["input"], result["verdict"]["uses"]
    of_result = {
        "arm": source["cell"],
        "day": (source["recorded"] or _NO_DAY)[:10],
        "input": source["sha256"],
        "recorded": source["recorded"],
        "robot": result["robot"],
        "method": result["method"],
        "configuration": source["configuration"],
        "relative_error": number(result["relative_error"]),
        **{use: uses[use.replace("_", "-")]["applicable"] for use in _USES},
    }
    for parameter in result["parameters"]:
        numbers = {name: number(parameter[name]) for name in _NUMBERS[:3]}
        yield {**of_result, "parameter": parameter["name"], "unit": parameter["unit"], **numbers}


def batch(
    files: Iterable[_Path],
    cells: _Path | Callable[[str], _Path],
    out: _Path,
    *,
    map: Callable[[Callable[[Task], Output], list[Task]], Iterable[Output]] = map,
) -> Batch:
    """Identifies many recordings. Each has one output, a file in ``out`` that is named by what it comes from: recording,
    configuration and version of didim. Outputs are written whole, and what is there is not computed again, so that the
    same call completes a batch that was interrupted, and adds new recordings to an old one.

    Args:
        files: The recordings, in any format of the command line.
        cells: The cell file of all of them, or a function that returns the one of a recording's path.
        out: The folder of the outputs; it is made. Every worker needs these paths.
        map: A function that maps another one over a list, as the built-in ``map``: ``Executor.map`` of
            ``concurrent.futures``, ``Pool.map`` of ``ray.util.multiprocessing``, or
            ``lambda work, tasks: client.gather(client.map(work, tasks))`` for Dask.

    Returns:
        The outcomes, in the order of the files. A recording that is refused has its reason, and is tried again by the next call.

    Raises:
        ConfigurationError: A cell cannot be read.
        UsageError: ``cells`` is a cell in memory; workers need its file. Or ``files`` is one path.

    Example:
        >>> with ProcessPoolExecutor() as pool:
        ...     done = didim.batch(Path("drives").glob("*.csv"), "cell.toml", "results", map=pool.map)
        >>> done.to_parquet("parquet")
    """
    if isinstance(cells, Cell):
        raise UsageError("cells is a cell in memory; save it, and give its file")
    if isinstance(files, (str, PathLike)):
        raise UsageError("files is one path; give a list of paths")
    of_file = cells if callable(cells) else lambda _: cells
    folder = Path(out).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    paths = [str(Path(file).absolute()) for file in files]
    cell_files = [str(Path(of_file(path)).absolute()) for path in paths]
    # A wrong cell is an error before any work.
    known = {cell: Cell.read(cell).configuration for cell in dict.fromkeys(cell_files)}
    tasks = [Task(path, cell, known[cell], str(folder)) for path, cell in zip(paths, cell_files)]
    done, begun = Batch(folder), time.monotonic()
    said = begun
    for output in map(identify_task, tasks):
        done.append(output)
        if time.monotonic() - said > _PROGRESS_S:
            said = time.monotonic()
            _LOGGER.info("%d of %d recordings after %.0f s", len(done), len(tasks), said - begun)
    if [of.file for of in done] != paths:
        raise UsageError("map returned other outcomes than one for each task, in their order")
    return done


def identify_task(task: Task) -> Output:
    """Identifies one recording, if its output is not there. This is what :func:`batch` maps."""
    cell = _cell(task.cell, task.configuration)
    file = Path(task.file)
    try:
        before = _stamp(file)
        recording = _sha256(file)
        parts = ["didim", _native.__version__, task.configuration, recording]
        path = Path(task.out) / f"{hashlib.sha256(chr(10).join(parts).encode()).hexdigest()}.json"
        if path.exists():
            return Output(task.file, task.cell, str(path), "there")
        data = read(task.file, cell)
        result = identify(cell, data)
        if _stamp(file) != before:
            raise DataError(f"{file}: it changed while it was read")
    except (Error, OSError) as error:
        return Output(task.file, task.cell, "", "refused", str(error))
    source = {"sha256": recording, "cell": cell.name, "configuration": task.configuration, "recorded": data.recorded}
    text = result._native.json()
    _write(path, f'{text[:-1]},"input":{json.dumps(source, ensure_ascii=False)}}}')
    return Output(task.file, task.cell, str(path), "computed")


def _stamp(path: Path) -> list[tuple[str, int, int]]:
    """Returns names, sizes and times of a file, or of the files of a folder."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return [(str(of), of.stat().st_size, of.stat().st_mtime_ns) for of in files]


@lru_cache(maxsize=16)
def _cell(path: str, configuration: str) -> Cell:
    """Reads a cell once in each worker. Its files have to be those of the batch."""
    cell = Cell.read(path)
    if cell.configuration != configuration:
        raise ConfigurationError(f"{path}: this cell, or a file that it names, is another one than that of the batch")
    return cell


def _sha256(path: Path) -> str:
    """Returns the SHA-256 of a file; of a folder, that of the names and hashes of its files."""
    hashed = hashlib.sha256()
    if path.is_dir():
        for file in sorted(of for of in path.rglob("*") if of.is_file()):
            hashed.update(f"{file.relative_to(path).as_posix()} {_sha256(file)}\n".encode())
        return hashed.hexdigest()
    with path.open("rb") as source:
        while block := source.read(_BLOCK):
            hashed.update(block)
    return hashed.hexdigest()


def _write(path: Path, text: str) -> None:
    """Writes a file that is there completely or not at all, whoever writes it at the same time."""
    with tempfile.NamedTemporaryFile("w", encoding="utf-8", dir=path.parent, prefix=".", delete=False) as out:
        try:
            out.write(text + "\n")
            out.flush()
            os.fsync(out.fileno())
            os.chmod(out.fileno(), 0o644)
            os.replace(out.name, path)
        except BaseException:
            os.unlink(out.name)
            raise
