"""The choice of clips of a split for a run.

Keys and seeds of cases do not depend on which others are asked for, so that a later run of all clips
goes on from there.
"""

from collections.abc import Collection, Iterable, Sequence
from fnmatch import fnmatchcase

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.files import composed


def fits(clip: str, pattern: str) -> bool:
    """Whether a pattern (``walk*``) means a clip: in any case, and a name with brackets as it is."""
    clip, pattern = (composed(name).casefold() for name in (clip, pattern))
    return clip == pattern or fnmatchcase(clip, pattern)


def check(texts: Sequence[str]) -> tuple[str, ...]:
    """The texts. Raises BenchError for one without a pattern: it would ask for all clips."""
    for text in texts:
        if not text.replace(",", "").strip():
            raise BenchError(f"{text!r} names no clip; leave it out for all of them, or name some: 'walk*'")
    return tuple(texts)


def patterns(texts: Iterable[str], clips: Collection[str]) -> list[str]:
    """Patterns of these clips, of which one text may hold several (``"walk*,jump"``), unless it fits a clip
    as it is: names may have commas."""
    patterns = []
    for text in texts:
        one = any(fits(clip, text.strip()) for clip in clips)
        parts = [text] if one else text.split(",")
        patterns += [part.strip() for part in parts if part.strip()]
    return patterns


def chosen(infos: Sequence[CaseInfo], texts: Sequence[str], limit: int) -> list[CaseInfo]:
    """The cases of the clips that fit any pattern of the texts, or of all; of at most ``limit`` of these
    clips, evenly spread over the case list, where that is above 0."""
    clips = list(dict.fromkeys(info.clip for info in infos))
    if texts:
        named = patterns(texts, clips)
        clips = [clip for clip in clips if any(fits(clip, pattern) for pattern in named)]
    if 0 < limit < len(clips):
        clips = [clips[number * len(clips) // limit] for number in range(limit)]
    names = set(clips)
    return [info for info in infos if info.clip in names]
