"""Specs as people write them, with files of plug-ins for names: ``my_method.py[k=2]+my_post.py``."""

from __future__ import annotations

import re
from dataclasses import replace
from os import PathLike
from pathlib import Path

from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.plugins.trial import try_import

_FILE = re.compile(r"(?:^|(?<=\+))[^\[\]+@'\"]+\.py(?=[\[+@]|$)")


def parse(text: str | Spec) -> Spec:
    """The spec of a text, whose files are added to the registry. Raises BenchError for one that is no
    plug-in."""
    return text if isinstance(text, Spec) else Spec.parse(with_names(text))


def dataset(text: str, root: str | PathLike[str] | None = None) -> Spec:
    """The data set that a name and a folder of its files mean together; the folder wins."""
    spec = parse(text)
    return spec if root is None else spec.with_parameters(root=str(root))


def with_names(text: str) -> str:
    """A text with the names of plug-ins in place of their files, which are added to the registry."""
    return _FILE.sub(_added, text.strip())


def written(spec: Spec) -> str:
    """The text that ``parse`` reads as this spec, also in a process that does not know its files yet."""
    files = {Path(path).stem: path for path, _ in registry.files()}
    parts = [(spec.alone if not spec.environment else replace(spec, posts=())), *spec.posts]
    return "+".join(files.get(each.name, each.name) + str(each).removeprefix(each.name) for each in parts)


def _added(file: re.Match[str]) -> str:
    path = Path(file[0])
    path = path.parent if path.name == "__init__.py" else path
    try_import(path)
    return registry.add_file(path).name
