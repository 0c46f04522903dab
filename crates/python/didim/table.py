"""Values with their uncertainty, and tables as text and HTML."""

from __future__ import annotations

import html
import importlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd


def optional(module: str, extra: str) -> Any:
    """Returns a module that is not always installed.

    Raises:
        ImportError: It is not; the message says how to install it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ImportError(f"this needs {error.name}: pip install 'didim[{extra}]'") from error


def number(value: float | None) -> float:
    """Returns a number of a JSON object; NaN for one that does not exist."""
    return float("nan") if value is None else float(value)


def digits(value: float, count: int = 2) -> str:
    """Returns a number with so many significant digits, without an exponent up to a million."""
    return f"{float(f'{value:.{count}g}'):.12g}"


@dataclass(frozen=True)
class UncertainValue:
    """A value with its standard deviation, in one unit.

    Attributes:
        value: The value.
        standard_deviation: Its standard deviation.
    """

    value: float
    standard_deviation: float

    @classmethod
    def _of(cls, found: Mapping[str, Any] | None) -> UncertainValue | None:
        return None if found is None else cls(number(found["value"]), number(found["standard_deviation"]))

    def __str__(self) -> str:
        return f"{digits(self.value, 4)} ± {digits(self.standard_deviation)}"


class Table:
    """An object that is shown as a table: aligned text, or HTML in the colours of the notebook."""

    def _rows(self) -> list[list[str]]:
        """Returns the cells; the first row is the head."""
        raise NotImplementedError

    def __repr__(self) -> str:
        rows = self._rows()
        widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
        cells = [[cell.ljust(width) for cell, width in zip(row, widths)] for row in rows]
        return "\n".join("  ".join(row).rstrip() for row in cells)

    def _repr_html_(self) -> str:
        def line(cells: list[str], tag: str) -> str:
            return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

        head, *body = self._rows()
        rows = "".join(line(row, "td") for row in body)
        return f"<table><thead>{line(head, 'th')}</thead><tbody>{rows}</tbody></table>"


@dataclass(frozen=True)
class Parameter:
    """An identified parameter.

    Attributes:
        name: Its name, for example ``zz1r`` or ``fc_m6``.
        unit: SI unit of value and standard deviations.
        value: The estimate.
        standard_deviation: Statistical standard deviation, corrected for the colour of the residuals.
        combined_standard_deviation: Combined standard uncertainty: with the uncertainty of what the cell configures.
            NaN where a command states none.
    """

    name: str
    unit: str
    value: float
    standard_deviation: float
    combined_standard_deviation: float


class Parameters(Table, Sequence[Parameter]):
    """Identified parameters, by position or by name. A slice is a table as well."""

    def __init__(self, parameters: Iterable[Parameter]) -> None:
        self._all = list(parameters)

    @classmethod
    def _of(cls, found: Iterable[Mapping[str, Any]]) -> Parameters:
        keys = ("value", "standard_deviation", "combined_standard_deviation")
        return cls(Parameter(of["name"], of["unit"], *(number(of.get(key)) for key in keys)) for of in found)

    def __len__(self) -> int:
        return len(self._all)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            for parameter in self._all:
                if parameter.name == key:
                    return parameter
            raise KeyError(key)
        return Parameters(self._all[key]) if isinstance(key, slice) else self._all[key]

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self._all)

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [parameter.name for parameter in self._all]

    @property
    def units(self) -> list[str]:
        """SI units of the parameters."""
        return [parameter.unit for parameter in self._all]

    @property
    def values(self) -> NDArray[np.float64]:
        """Values in SI units."""
        return np.array([parameter.value for parameter in self._all])

    @property
    def standard_deviations(self) -> NDArray[np.float64]:
        """Statistical standard deviations in SI units."""
        return np.array([parameter.standard_deviation for parameter in self._all])

    @property
    def combined_standard_deviations(self) -> NDArray[np.float64]:
        """Combined standard uncertainties in SI units."""
        return np.array([parameter.combined_standard_deviation for parameter in self._all])

    def to_frame(self) -> pd.DataFrame:
        """Returns the parameters as a :class:`pandas.DataFrame` with the names as its index."""
        pandas = optional("pandas", "frame")
        columns = {
            "unit": self.units,
            "value": self.values,
            "standard_deviation": self.standard_deviations,
            "combined_standard_deviation": self.combined_standard_deviations,
        }
        frame: pd.DataFrame = pandas.DataFrame(columns, index=pandas.Index(self.names, name="parameter"))
        return frame

    def _rows(self) -> list[list[str]]:
        head = ["parameter", "value", "unit", "σ statistical", "σ combined"]
        cells = [
            [of.name, f"{of.value:.6g}", of.unit, digits(of.standard_deviation), digits(of.combined_standard_deviation)]
            for of in self._all
        ]
        has_combined = not np.all(np.isnan(self.combined_standard_deviations))
        return [row if has_combined else row[:-1] for row in [head, *cells]]
