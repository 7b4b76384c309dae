"""Shards that are stored and left to whoever carries them out with ``bench work``."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Self

from retarget_bench.errors import BenchError


class ByHand:
    """Ends the run once its shards are stored; its repetition takes up what they answered."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(self, folder: Path, numbers: Sequence[int]) -> Iterator[tuple[int, str]]:
        """Raises BenchError that says what to do."""
        raise BenchError(
            f"the shards 0 to {numbers[-1]} are to be carried out: bench work {folder} SHARD. Then run "
            "again to take up what they answered"
        )
