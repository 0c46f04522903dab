"""The notebooks of the documentation, cell by cell and without Jupyter: their text outputs are those that they show."""

from __future__ import annotations

import ast
import contextlib
import io
import json
from pathlib import Path
from typing import Any

import pytest

from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))


def run(source: str, names: dict[str, Any]) -> str:
    """Runs a cell. Returns what it prints, and the text of the expression at its end."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, "cell", "exec"), names)
        value = None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    return printed.getvalue() + ("" if value is None else repr(value))


def shown(cell: dict[str, Any]) -> str:
    """Returns the text outputs of a cell, without those of its pictures."""
    texts = [of.get("text") or of["data"]["text/plain"] for of in cell["outputs"]]
    return "".join("".join(text) for text in texts if not "".join(text).startswith("<Figure"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_gives_what_it_shows(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    monkeypatch.chdir(path.parent)
    names: dict[str, Any] = {"__name__": "__main__"}
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    assert len(cells) > 5
    for cell in cells:
        source = "".join(cell["source"])
        assert run(source, names).strip() == shown(cell).strip(), source


def test_every_notebook_has_its_page() -> None:
    summary = (ROOT / "docs/SUMMARY.md").read_text()
    assert len(NOTEBOOKS) == 3
    for path in NOTEBOOKS:
        page = path.with_suffix(".md").read_text()
        assert f"notebooks/{path.stem}.md" in summary
        for cell in json.loads(path.read_text())["cells"]:
            assert "".join(cell["source"]) in page
