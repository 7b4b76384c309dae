"""The files that a plug-in depends on, Python and TOML, and hashes of their statements.

Comments, docstrings, blank lines and the engine's own layout do not count. Nothing is imported.
"""

import ast
import hashlib
import io
import tokenize
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from retarget_bench.errors import BenchError

ENGINE = "retarget_bench"
FOLDER = Path(__file__).resolve().parents[1]


def code_hash(paths: Iterable[Path]) -> str:
    """Eight hex digits of Python files, by name and statements, wherever they lie and in any order.

    One that is not Python counts byte by byte.
    """
    texts = sorted(f"{path.name}\0{statements(path.read_bytes())}\0" for path in set(paths))
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:8]


# ---------------------------------------------------------------------------------------------- files
def own_files(path: Path, package: str = "") -> set[Path]:
    """The files of a plug-in: its file or folder, and what they reach by relative imports.

    path: its file, which may have ``variants.toml`` beside it, or its folder's ``__init__.py``.
    package: its module, if it lies in an installed package, all files of which count.
    """
    if package:
        above = package.count(".") - (path.name != "__init__.py")
        return _code_files(path.parents[above]) if above >= 0 else {path}
    variants = [each for each in (path.with_name("variants.toml"),) if each.is_file()]
    return reached(_code_files(path.parent) if path.name == "__init__.py" else {path, *variants})


def package_code(name: str) -> set[Path]:
    """Every code file of a package of the engine, however deep, or that of a module."""
    path = FOLDER.joinpath(*name.split("."))
    return _code_files(path) if path.is_dir() else {path.with_suffix(".py")}


def reached(paths: Iterable[Path], package: str = "") -> set[Path]:
    """Files, and what they reach by relative imports, and by full names of a package of the engine."""
    waiting, files = list(paths), set[Path]()
    while waiting:
        if (path := waiting.pop()) not in files:
            files.add(path)
            waiting += _imported_files(path, package)
    return files


def _code_files(folder: Path) -> set[Path]:
    """Python and TOML, such as variants of a method."""
    files = (*folder.rglob("*.py"), *folder.rglob("*.toml"))
    return {path for path in files if "__pycache__" not in path.parts}


def _imported_files(path: Path, package: str) -> Iterator[Path]:
    """The files that a file's imports run: of packages on the way, and of modules."""
    head = f"{ENGINE}.{package}."
    for level, name in _imports(path.read_bytes()):
        if level:
            folder, inside = path.parents[level - 1], name
        elif package and f"{name}.".startswith(head):
            folder, inside = FOLDER.joinpath(*package.split(".")), f"{name}.".removeprefix(head)
        else:
            continue
        for part in ("", *inside.split(".")):
            folder = folder / part
            yield from (f for f in (folder / "__init__.py", folder.with_suffix(".py")) if f.is_file())


@cache
def _imports(source: bytes) -> frozenset[tuple[int, str]]:
    """The level (0: by full name) and the dotted name of everything that a Python file imports."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return frozenset()
    names: set[tuple[int, str]] = set()
    for node in all_statements(tree):
        if isinstance(node, ast.Import):
            names |= {(0, each.name) for each in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = f"{node.module}." if node.module else ""
            names |= {(node.level, f"{module}{each.name}") for each in node.names}
    return frozenset(names)


def all_statements(tree: ast.Module) -> Iterator[ast.stmt]:
    """The statements of a file, however deep: a tenth of the nodes that ``ast.walk`` visits."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.stmt):
            yield node
        for blocks in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting.extend(getattr(node, blocks, ()))


# --------------------------------------------------------------------------------------------- hashes
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
    written = [line.rstrip() for line in lines if line.strip()]
    return "\n".join([f"from {ENGINE} import {', '.join(sorted(imported))}"] * bool(imported) + written)


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
    paths = sorted(p for p in folder.iterdir() if p.suffix.lower() in (".npz", ".bvh"))
    if not paths:
        raise BenchError(f"{folder} holds no .npz or .bvh file; give the folder with the predictions")
    total = hashlib.sha256()
    for path in paths:
        total.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return total.hexdigest()[:8]
