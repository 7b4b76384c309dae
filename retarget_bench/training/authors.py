"""Weights in the files that a paper's authors publish, in place of ours. Nothing in them is executed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from retarget_bench.api import MethodCard
from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training.record import Record

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True)
class AuthorsWeights:
    """Weights of a method by the authors of its paper.

    path: what messages call them. files: all that ``read`` reads; their bytes are the identity of the
    weights in results. read: the tensors by our names; raises FileError where a file is not the authors'.
    note: a sentence on them for ``bench info``. facts: the parameters that they need, of those in
    ``LearnedMethod.facts``, the one that decides most first.
    """

    path: Path
    files: tuple[Path, ...]
    read: Callable[[], Mapping[str, Tensor]]
    note: str
    facts: Mapping[str, Scalar] = field(default_factory=dict)

    @cached_property
    def hash(self) -> str:
        """Sixteen hex digits of the bytes of all files. Raises FileError where one cannot be read."""
        total = hashlib.sha256()
        for file in self.files:
            try:
                data = file.read_bytes()
            except OSError as error:
                raise FileError(file, f"cannot be read ({error.strerror or error})") from error
            total.update(f"{len(data)}\n".encode() + data)
        return total.hexdigest()[:16]

    def check(self, method: str, facts: Mapping[str, Scalar]) -> None:
        """Raises BenchError where a method has other parameters than the weights need; it names one."""
        for name, value in self.facts.items():
            if facts[name] != value:
                raise BenchError(
                    f"{self.path}: these are the weights of {method}'s authors, which have {name}={value}; "
                    f"write {name}={value} in the brackets of {method}"
                )

    def card(self, method: MethodCard) -> Record:
        return Record(
            method=method.name,
            version=method.version,
            facts=self.facts,
            training_manifest={},
            notes=[self.note],
            hash=self.hash,
        )
