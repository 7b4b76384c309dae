"""Hashes of statements: comments, docstrings, blank lines and the engine's own layout do not count."""

import ast
import hashlib
import io
import tokenize
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.plugins.own_files import all_statements

ENGINE = "retarget_bench"
FOLDER = Path(__file__).resolve().parents[1]


def code_hash(files: Iterable[tuple[str, Path]]) -> str:
    """Eight hex digits of Python files, each under a relative name, in the order of these names.

    A file counts by its statements (``statements``). One that is not Python counts byte by byte.
    """
    total = hashlib.sha256()
    for name, path in sorted(files):
        total.update(f"{name}\0{statements(path.read_bytes())}\0".encode())
    return total.hexdigest()[:8]


def relative_to(folder: Path, paths: Iterable[Path]) -> Iterator[tuple[str, Path]]:
    """Files under their names relative to a folder; those outside of it under their own names."""
    for path in paths:
        inside = path.is_relative_to(folder)
        yield (path.relative_to(folder).as_posix() if inside else path.name), path


def package_code(name: str) -> Iterator[tuple[str, Path]]:
    """Every Python file of a package of the engine, however deep, or that of a module.

    Names are relative to the folder that it lies in. Nothing is imported.
    """
    path = FOLDER.joinpath(*name.split("."))
    files = (file for file in path.rglob("*.py") if "__pycache__" not in file.parts)
    return relative_to(path.parent, files if path.is_dir() else [path.with_suffix(".py")])


def imports(path: Path, name: str) -> bool:
    """True if a Python file imports a package of the engine, or anything in it, by its full name."""
    return any(f"{each}.".startswith(f"{ENGINE}.{name}.") for each in _imported(path))


def reached_code(package: str, paths: Iterable[Path]) -> Iterator[tuple[str, Path]]:
    """The files of a package of the engine that files import by full names, and what these import of it.

    Names are relative to the folder that the package lies in. Nothing is imported.
    """
    folder, head = FOLDER.joinpath(*package.split(".")), f"{ENGINE}.{package}."
    waiting, found = list(paths), set[Path]()
    while waiting:
        for name in _imported(waiting.pop()):
            if f"{name}.".startswith(head):
                new = set(_files_of(folder, f"{name}.".removeprefix(head).split("."))) - found
                found |= new
                waiting += new
    return relative_to(folder.parent, found)


def _files_of(folder: Path, parts: Sequence[str]) -> Iterator[Path]:
    """The files that an import of a name in a package runs: of packages on the way, and of a module."""
    for part in ("", *parts):
        folder = folder / part
        yield from (file for file in (folder / "__init__.py", folder.with_suffix(".py")) if file.is_file())


@cache
def _imports_of(source: bytes) -> frozenset[str]:
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return frozenset()
    found: set[str] = set()
    for node in all_statements(tree):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found |= {f"{node.module}.{each.name}" for each in node.names}
    return frozenset(found)


def _imported(path: Path) -> frozenset[str]:
    """Full names of what a Python file imports, relative imports aside."""
    return _imports_of(path.read_bytes())


@cache  # most files count for every method or metric of a run
def statements(source: bytes) -> str:
    """A module's text without comments, docstrings, blank lines and trailing space.

    Imports from the engine are listed once, by name and without their modules, so that modules can move.
    The text depends on no version of Python.
    """
    try:
        tree = ast.parse(source)
        text = source.decode("utf-8")
    except (SyntaxError, ValueError):
        return source.decode("latin-1")
    lines = text.splitlines()
    _cut_comments(lines, text)
    imported: set[str] = set()
    for node in all_statements(tree):
        if isinstance(node, ast.ImportFrom) and not node.level and str(node.module).split(".")[0] == ENGINE:
            imported |= {f"{each.name} as {each.asname or each.name}" for each in node.names}
            _blank(lines, node)
        elif isinstance(node, ast.Expr) and isinstance(getattr(node.value, "value", None), str):
            _blank(lines, node)
    said = [line.rstrip() for line in lines if line.strip()]
    return "\n".join([f"from {ENGINE} import {', '.join(sorted(imported))}"] * bool(imported) + said)


def _cut_comments(lines: list[str], text: str) -> None:
    if "#" not in text:
        return
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]


def _blank(lines: list[str], node: ast.stmt) -> None:
    """Take a statement out; the number of lines stays."""
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    before = lines[first].encode()[: node.col_offset].decode()
    after = lines[last].encode()[node.end_col_offset :].decode() if node.end_col_offset else ""
    lines[first] = before + (after if last == first else "")
    for row in range(first + 1, last + 1):
        lines[row] = after if row == last else ""


@cache
def folder_hash(folder: Path) -> str:
    """Eight hex digits of every motion file in a folder of predictions."""
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in (".npz", ".bvh"))
    if not found:
        raise BenchError(f"{folder} holds no .npz or .bvh file; give the folder with the predictions")
    total = hashlib.sha256()
    for path in found:
        total.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return total.hexdigest()[:8]
