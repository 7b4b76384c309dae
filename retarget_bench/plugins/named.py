"""Specs as people write them, in which a plug-in may be given by its file: ``my_method.py[k=2]+my_post.py``."""

from __future__ import annotations

import re
from pathlib import Path

from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.plugins.trial import try_import

_FILE = re.compile(r"(?:^|(?<=\+))[^\[\]+@'\"]+\.py(?=[\[+@]|$)")


def parse(text: str | Spec) -> Spec:
    """The spec of a text, whose files are added to the registry. Raises BenchError for what is no plug-in."""
    return text if isinstance(text, Spec) else Spec.parse(with_names(text))


def with_names(text: str) -> str:
    """A text with the names of plug-ins in place of their files, which are added to the registry."""
    return _FILE.sub(_added, text.strip())


def _added(file: re.Match[str]) -> str:
    path = Path(file[0])
    path = path.parent if path.name == "__init__.py" else path
    try_import(path)
    return registry.add_file(path).name
