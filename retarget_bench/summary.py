"""Rows to means: per case, then per source clip, then over clips, for every method and split."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from retarget_bench import records, timing
from retarget_bench.api import SPLITS
from retarget_bench.errors import FileError
from retarget_bench.records import Place, Results

COVERAGE = 0.95
"""A method that answered a smaller share of the cases is listed, and not ranked."""


@dataclass(frozen=True)
class Mean:
    """A mean over clips. ``n`` counts cases, ``clips`` the source clips they come from."""

    value: float
    n: int
    clips: int


@dataclass
class Score:
    """One method on one split.

    means:  value id -> Mean; a value that no case has is absent.
    curves: value id -> index -> Mean.
    fps:    frames per second of one process and thread, or None where it was not measured.
    """

    label: str
    header: Mapping[str, Any]
    means: dict[str, Mean]
    curves: dict[str, dict[str, Mean]]
    fps: float | None

    @property
    def asked(self) -> int:
        return int(self.header["counts"]["asked"])

    @property
    def ok(self) -> int:
        return int(self.header["counts"]["ok"])

    @property
    def unranked(self) -> str:
        """Why the method is not ranked; "" where it is."""
        method = self.header["method"]
        if method["control"]:
            return "control"
        if method["privileged"]:
            return "sees " + ", ".join(name.replace("_", " ") for name in method["privileged"])
        return "" if self.ok >= COVERAGE * self.asked else f"answered {self.ok} of {self.asked}"


@dataclass
class Section:
    """All methods on one split of one data set."""

    dataset: str
    split: str
    notes: list[str]
    scores: list[Score]
    pairs: int
    clips: int
    frames: int
    values: dict[str, Mapping[str, Any]] = field(default_factory=dict)


def sections(places: Iterable[Place]) -> list[Section]:
    """The results at these places, by data set and split (self, intra, cross).

    A result whose data set has changed since is a section of its own: its label says so.
    """
    grouped: dict[tuple[str, str], list[Results]] = {}
    for place in places:
        results = records.read_results(place)
        label = results.header["dataset"]["label"]
        grouped.setdefault((label, place.split), []).append(results)
    order = {split: rank for rank, split in enumerate(SPLITS)}
    keys = sorted(grouped, key=lambda key: (key[0], order.get(key[1], len(order))))
    by_label = {key: {r.place.method: r for r in grouped[key]} for key in keys}
    return [
        _section(label, split, grouped[label, split], by_label.get((label, "self"), {}))
        for label, split in keys
    ]


def _section(label: str, split: str, results: Sequence[Results], selves: Mapping[str, Results]) -> Section:
    contents = {each.header["dataset"]["content"] for each in results}
    if len(contents) > 1:
        folder = results[0].place.folder
        raise FileError(
            folder,
            f"holds results of {len(contents)} versions of {label}; run the methods again, or delete "
            "the old results",
        )
    cases = results[0].cases
    values: dict[str, Mapping[str, Any]] = {}
    for each in results:
        values |= each.header["values"]
    return Section(
        dataset=label,
        split=split,
        notes=list(results[0].header["dataset"]["notes"]),
        scores=[_score(each, selves.get(each.place.method)) for each in results],
        pairs=len({info.pair for info in cases.values()}),
        clips=len({info.clip for info in cases.values()}),
        frames=sum(info.frames for info in cases.values()),
        values=values,
    )


def _score(results: Results, selves: Results | None) -> Score:
    """Means of one method; values of protocols that count self pairs as intra pool those too."""
    declared = results.header["values"]
    numbers = _by_clip(results)
    if results.place.split == "intra":
        extra = _by_clip(selves) if selves else {}
        for key in [key for key in numbers if declared[key[0]]["with_self"]]:
            if key not in extra:
                del numbers[key]
                continue
            for clip, values in extra[key].items():
                numbers[key].setdefault(clip, []).extend(values)
    means = {value: _mean(clips) for (value, index), clips in numbers.items() if not index}
    curves: dict[str, dict[str, Mean]] = {}
    for (value, index), clips in numbers.items():
        if index:
            curves.setdefault(value, {})[index] = _mean(clips)
    return Score(results.header["method"]["label"], results.header, means, curves, _fps(results.place))


def _by_clip(results: Results) -> dict[tuple[str, str], dict[str, list[float]]]:
    """(value id, index) -> clip -> numbers of its cases."""
    numbers: dict[tuple[str, str], dict[str, list[float]]] = {}
    for entry in results.entries:
        clip = results.cases[entry.case].clip
        for value_id, value in entry.values.items():
            for index, number in value.items() if isinstance(value, dict) else (("", value),):
                numbers.setdefault((value_id, index), {}).setdefault(clip, []).append(number)
    return numbers


def _mean(clips: Mapping[str, Sequence[float]]) -> Mean:
    per_clip = [sum(values) / len(values) for values in clips.values()]
    return Mean(sum(per_clip) / len(per_clip), sum(map(len, clips.values())), len(per_clip))


def _fps(place: Place) -> float | None:
    times = timing.read(place)
    seconds = sum(second for _, second in times)
    return sum(frames for frames, _ in times) / seconds if seconds > 0 else None
