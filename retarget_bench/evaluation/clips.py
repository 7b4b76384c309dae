"""The choice of clips of a split for a run.

Keys and seeds of cases do not depend on which others are asked for, so that a later run of all clips
goes on from there.
"""

from collections.abc import Sequence
from fnmatch import fnmatchcase

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError


def fits(clip: str, pattern: str) -> bool:
    """Whether a pattern (``walk*``) means a clip: in any case, and a name with brackets as it is."""
    clip, pattern = clip.casefold(), pattern.casefold()
    return clip == pattern or fnmatchcase(clip, pattern)


def patterns(texts: Sequence[str]) -> tuple[str, ...]:
    """Patterns of clips, of which one text may hold several (``"walk*,jump"``).

    Raises BenchError for a text without any: it would ask for all clips.
    """
    patterns = []
    for text in texts:
        patterns += (parts := [part.strip() for part in text.split(",") if part.strip()])
        if not parts:
            raise BenchError(f"{text!r} names no clip; leave it out for all of them, or name some: 'walk*'")
    return tuple(patterns)


def chosen(infos: Sequence[CaseInfo], patterns: Sequence[str], limit: int) -> list[CaseInfo]:
    """The cases of the clips that fit any pattern, or of all; of at most ``limit`` of these clips, evenly
    spread over the case list, where that is above 0."""
    clips = list(dict.fromkeys(info.clip for info in infos))
    if patterns:
        clips = [clip for clip in clips if any(fits(clip, pattern) for pattern in patterns)]
    if 0 < limit < len(clips):
        clips = [clips[number * len(clips) // limit] for number in range(limit)]
    names = set(clips)
    return [info for info in infos if info.clip in names]
