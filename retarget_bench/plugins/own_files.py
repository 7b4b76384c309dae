"""The Python files whose text decides what a plug-in does."""

import ast
from collections.abc import Iterator
from pathlib import Path


def own_files(path: Path, package: str = "") -> list[tuple[str, Path]]:
    """The files of a plug-in, sorted, with names that do not depend on where they lie; none is imported.

    path: its file, or its folder's ``__init__.py``. package: its module, if it lies in an installed
    package, all files of which count; of others, the files that relative imports reach do.
    """
    home = path.parent
    if package:
        above = package.count(".") - (path.name != "__init__.py")
        reached = set(_tree(path.parents[above]) if above >= 0 else [path])
    else:
        own, reached = _tree(home) if path.name == "__init__.py" else [path], set()
        while own:
            file = own.pop()
            if file not in reached:
                reached.add(file)
                own.extend(_relative_imports(file))
    return [
        (file.relative_to(home).as_posix() if file.is_relative_to(home) else file.name, file)
        for file in sorted(reached)
    ]


def _tree(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*.py") if "__pycache__" not in path.parts)


def _relative_imports(file: Path) -> Iterator[Path]:
    """The files that a file's relative imports name."""
    try:
        tree = ast.parse(file.read_bytes())
    except SyntaxError:
        return
    for node in all_statements(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = file.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for place in (base, *(base / alias.name for alias in node.names)):
                yield from (p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file())


def all_statements(tree: ast.Module) -> Iterator[ast.stmt]:
    """The statements of a file, however deep: a tenth of the nodes that ``ast.walk`` visits."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.stmt):
            yield node
        for blocks in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting.extend(getattr(node, blocks, ()))
