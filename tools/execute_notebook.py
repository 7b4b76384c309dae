"""Carries out docs/compare_methods.ipynb and stores what cells show: tables as text, players as pictures.

python -m tools.execute_notebook
"""

from __future__ import annotations

import ast
import base64
import io
import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd

from retarget_bench.python.views import Player
from retarget_bench.viewer import drawing
from retarget_bench.viewer.renderer import DrawingStyle

NOTEBOOK = Path(__file__).parents[1] / "docs" / "compare_methods.ipynb"
MOMENTS = 6
"""Columns of a picture that stands for a player."""


def carried_out(source: str, names: dict[str, Any]) -> Any:
    """What the last line of a cell shows, if it is an expression.

    ``%%writefile`` writes the file; other magics, which install, do nothing.
    """
    if source.startswith("%%writefile "):
        head, text = source.split("\n", 1)
        Path(head.split()[1]).write_text(text, encoding="utf-8")
        return None
    tree = ast.parse(re.sub(r"^(\s*)%.*", r"\1pass", source, flags=re.MULTILINE))
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def text(value: Any) -> str:
    """A value as the stored notebook shows it, however wide."""
    return value.to_string() if type(value) is pd.DataFrame else repr(value)


def outputs(value: Any, number: int) -> list[dict[str, Any]]:
    """Of the cell with this number: none, or one."""
    if value is None:
        return []
    data: dict[str, Any] = {"text/plain": text(value).splitlines(keepends=True)}
    if isinstance(value, Player):
        data["image/png"] = base64.b64encode(_picture(value)).decode("ascii")
    return [{"data": data, "execution_count": number, "metadata": {}, "output_type": "execute_result"}]


def _picture(player: Player) -> bytes:
    scene = player.scene
    frames = drawing.moments(range(scene.frames), MOMENTS)
    style = DrawingStyle(drawing.usual_size(scene, len(frames), False))
    image = drawing.sheet(scene, style, frames)
    image = image.resize((image.width * 2 // 3, image.height * 2 // 3)).quantize(256)
    file = io.BytesIO()
    image.save(file, "png", optimize=True)
    return file.getvalue()


@contextmanager
def _empty_folder() -> Iterator[None]:
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def main() -> None:
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    names: dict[str, Any] = {}
    with _empty_folder():
        cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
        for number, cell in enumerate(cells, 1):
            value = carried_out("".join(cell["source"]), names)
            cell.update(execution_count=number, outputs=outputs(value, number))
    NOTEBOOK.write_text(json.dumps(notebook, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
