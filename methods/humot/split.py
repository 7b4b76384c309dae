"""The paper's validation: windows of the very clips that are trained on (``split=chunk``)."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from retarget_bench.training.data import ClipArrays


def held_out(clip: ClipArrays, starts: Sequence[int]) -> frozenset[int]:
    """The tenth of a clip's windows that are not trained on, by their starts; always the same ones.

    Four fifths of such a window are in windows beside it, most of which are trained on. The tenth is
    rounded, so that a clip of fewer than five windows keeps all of them.
    """

    def rank(start: int) -> bytes:
        return hashlib.sha256(f"{clip.character}/{clip.name}/{start}".encode()).digest()

    return frozenset(sorted(starts, key=rank)[: (len(starts) + 5) // 10])


__all__ = ["held_out"]
