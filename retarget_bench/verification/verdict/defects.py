"""Defects of a motion, and the verdict that lists them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from retarget_bench.motion import contact

MERGED = 0.2
"""Seconds: stretches of one defect that are no farther apart are one."""
OF_A_PART, IN_ALL = 3, 12
"""Most stretches that are printed of one kind and part, and of all."""
KINDS = {
    "snap": ("degrees", "snaps ({amount:.0f} degrees in {more}; source {source:.0f})"),
    "straight": ("degrees", "is straight (bent by {amount:.0f} degrees; source {source:.0f})"),
    "speed": ("m/s", "at {amount:.1f} m/s (source at this size {source:.1f}){more}"),
    "floor": ("cm", "goes through the floor ({amount:.0f} cm; source {source:.0f})"),
    "slide": ("cm", "slides ({amount:.0f} cm; source {source:.0f})"),
    "turned": ("degrees", "points elsewhere than the source's ({amount:.0f} degrees)"),
    "place": ("cm", "is elsewhere than the source's ({amount:.0f} cm, at this size)"),
    "inside": ("%", "is in the body ({amount:.0f} % of it{more})"),
}
"""Kind of a defect -> the unit of its amount, and its reason after the name of the part."""


@dataclass(frozen=True)
class Defect:
    """A stretch of frames to look at, and why.

    kind:     ``snap``, ``straight``, ``speed``, ``floor``, ``slide``, ``turned``, ``place`` or
              ``inside``.
    part:     of the body, for people: ``left knee``.
    first, last, worst: frames, counted from 0.
    amount:   at the worst frame, in ``unit``; source: likewise of the source, at the size of the result's
              body; None where the source has no such number.
    severity: amount over what would still have passed, above 1.
    reason:   for people: ``left knee snaps (31 degrees in a frame; source 9)``.
    """

    kind: str
    part: str
    first: int
    last: int
    worst: int
    amount: float
    source: float | None
    unit: str
    severity: float
    reason: str

    def text(self, fps: float) -> str:
        """One line; frames are counted from 1, as in players and pictures."""
        one = self.first == self.last
        frames = f"frame {self.first + 1}" if one else f"frames {self.first + 1}-{self.last + 1}"
        return f"{frames} ({self.first / fps:.1f} s): {self.reason}"


@dataclass(frozen=True, repr=False)
class Verdict:
    """The defects of a motion, and its joints that nothing drives.

    defects:  worst first. undriven: names of the joints that follow their parents.
    doubts:   sentences on what is a guess, or was read wrongly: then all of it is to be looked at.
    """

    frames: int
    fps: float
    defects: tuple[Defect, ...]
    undriven: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    @cached_property
    def worst(self) -> tuple[Defect, ...]:
        """Those that are printed, in the order of time: at most ``OF_A_PART`` of a kind and part, and
        ``IN_ALL``."""
        seen = Counter[tuple[str, str]]()
        chosen = []
        for each in self.defects:
            seen[each.kind, each.part] += 1
            if seen[each.kind, each.part] <= OF_A_PART:
                chosen.append(each)
        return tuple(sorted(chosen[:IN_ALL], key=lambda each: (each.first, each.part)))

    @property
    def summary(self) -> str:
        """``nothing to look at``, ``3 places to look at``, or that all of it is to be looked at."""
        count = len(self.defects)
        places = f"{count} place{'s' * (count > 1)} to look at"
        if self.doubts:
            return f"{places}, and all of it" if count else "no place stands out: look at all of it"
        return places if count else "nothing to look at"

    @property
    def lines(self) -> tuple[str, ...]:
        """A line for each of the worst, one that counts the others, and one for each doubt."""
        lines = [f"look at: {each.text(self.fps)}" for each in self.worst]
        left = len(self.defects) - len(self.worst)
        more = [f"look at: {left} more like these"] if left else []
        return (*lines, *more, *(f"look at all of it: {doubt}" for doubt in self.doubts))

    @property
    def followers(self) -> str:
        """A sentence on the undriven joints, "" where there are none."""
        if not (count := len(self.undriven)):
            return ""
        follow = "joint that nothing drives follows its parent"
        if count > 1:
            follow = "joints that nothing drives follow their parents"
        return f"{count} {follow}: {_some(self.undriven)}"

    def text(self) -> str:
        """All of it for a terminal, the summary last."""
        followers = [self.followers] if self.undriven else []
        return "\n".join([*self.lines, *followers, self.summary])

    def as_dict(self) -> dict[str, Any]:
        """For JSON: frames are counted from 1, as in ``text``."""
        return {
            "verdict": self.summary,
            "frames": self.frames,
            "fps": self.fps,
            "places": [self._place(each) for each in self.defects],
            "undriven": list(self.undriven),
            "doubts": list(self.doubts),
        }

    def _place(self, defect: Defect) -> dict[str, Any]:
        """A defect with frames from 1 and seconds, numbers as they are worth reading."""
        entry = asdict(defect)
        for name in ("first", "last", "worst"):
            entry[name] += 1
        entry["seconds"] = [round(frame / self.fps, 3) for frame in (defect.first, defect.last)]
        for name in ("amount", "source", "severity"):
            entry[name] = None if entry[name] is None else float(f"{entry[name]:.4g}")
        return entry

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Verdict on {self.frames} frames: {self.summary}>"


def stretches(wrong: np.ndarray, fps: float) -> list[slice]:
    """The stretches of a label ``(frames,)``, those near each other joined."""
    joined = contact.tidy(wrong, round(MERGED * fps), 1)
    return [slice(first, past) for first, past in contact.runs(joined).tolist()]


def defect(
    kind: str,
    part: str,
    frames: slice,
    worst: int,
    amount: float,
    source: float | None,
    severity: float,
    more: str = "",
) -> Defect:
    """A defect of one of the ``KINDS``; ``more`` goes into its reason."""
    unit, text = KINDS[kind]
    source = None if source is None else float(source)
    reason = f"{part} {text.format(amount=amount, source=source, more=more)}"
    first, last = frames.start, frames.stop - 1
    return Defect(kind, part, first, last, worst, float(amount), source, unit, float(severity), reason)


def _some(names: Sequence[str], shown: int = 6) -> str:
    """The first few names, and how many more."""
    more = len(names) - shown
    return ", ".join(names[:shown]) + (f" and {more} more" if more > 0 else "")
