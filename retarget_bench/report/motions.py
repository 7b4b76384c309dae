"""Cases in motion: the choice of worst, typical and best ones, and their packed scenes."""

import difflib
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.tables.model import count
from retarget_bench.viewer import player, scene_builder
from retarget_bench.viewer.packing import packed
from retarget_bench.viewer.scene import Scene
from retarget_bench.viewer.scene_builder import Over
from retarget_bench.viewer.skins import IN_PAGES

SHARES = (1.0, 0.5, 0.0)
"""Worst, median and best, as shares of the cases in order of how well they go."""
NEAR = 1 / 6
"""Share of the cases around the wanted place that count as equally near."""

Chosen = tuple[int, int, int]
"""Numbers of chapter, split and case."""


def chosen(chapters: Sequence[Chapter], most: int | None, requested: Sequence[str] = ()) -> list[Chosen]:
    """The cases to show, in the order in which they are to be packed: those asked for by id, then of every
    split in turn, cross first, its worst, median, best, next worst, ... case.

    most: so many in all; None: every one.

    How well a case goes is the mean of its places among the cases, over the ranked methods that answered
    it. Of the cases near the wanted place the one is taken whose kind, pair and bodies were shown least,
    then the nearest. Raises BenchError for an id that no result has.
    """
    splits = [
        (c, s, split)
        for c, chapter in enumerate(chapters)
        for s, split in reversed([*enumerate(chapter.splits)])
    ]
    ids = {info.id for _, _, split in splits for info in split.matrix.cases}
    if unknown := [case for case in requested if case not in ids]:
        near = difflib.get_close_matches(unknown[0], ids, 3, 0.5) or sorted(ids)[:3]
        raise BenchError(f"no case {unknown[0]!r} in these results; near it: {', '.join(near)}")
    candidates = [
        (c, s, case)
        for c, s, split in splits
        for case, info in enumerate(split.matrix.cases)
        if info.id in requested
    ]
    queues = [[(c, s, case) for case in order(split, most)] for c, s, split in splits]
    for turn in range(max(map(len, queues), default=0)):
        for queue in queues:
            if most is not None and len(candidates) >= most:
                return candidates
            if turn < len(queue) and queue[turn] not in candidates:
                candidates.append(queue[turn])
    return candidates


def order(split: Split, most: int | None = None) -> list[int]:
    """At most so many cases of a split that any method answered, in the order in which they are chosen; of
    all where none was answered: their sources can be seen, and why there is no answer."""
    badness = _badness(split)
    if np.isnan(badness).all():
        badness = np.zeros(len(badness))
    by_badness = [int(case) for case in np.argsort(badness, kind="stable") if not np.isnan(badness[case])]
    last = max(1, len(by_badness) - 1)
    left = {case: place / last for place, case in enumerate(by_badness)}
    shown: Counter[str] = Counter()
    ordered: list[int] = []
    while left and len(ordered) != most:
        share = SHARES[len(ordered) % len(SHARES)]

        def cost(case: int, wanted: float = share) -> tuple[bool, int, float]:
            away = abs(left[case] - wanted)
            return away > NEAR, sum(shown[trait] for trait in _traits(split, case)), away

        case = min(left, key=cost)
        shown.update(_traits(split, case))
        ordered.append(case)
        del left[case]
    return ordered


def _traits(split: Split, case: int) -> list[str]:
    info = split.matrix.cases[case]
    level = split.groups.get("level")
    traits = [f"kind {info.kind}", f"pair {info.pair}", f"source {info.source}", f"target {info.target}"]
    return traits if level is None else [*traits, f"level {level[case]}"]


def _badness(split: Split) -> np.ndarray:
    """``(cases,)``: the mean place over ranked methods (all where none is ranked); nan: nobody answered."""
    losses = split.losses[split.ranked] if split.ranked.any() else split.losses
    places = np.full(losses.shape, np.nan)
    for row, loss in enumerate(losses):
        there = np.flatnonzero(~np.isnan(loss))
        best_first = there[np.argsort(loss[there], kind="stable")]
        places[row, best_first] = np.arange(len(there)) / max(1, len(there))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of cases that nobody answered
        return np.nanmean(places, axis=0)


ROOM, MOST_ROOM = 1_900_000, 10_500_000
"""Bytes of packed scenes in a page where nobody says how many, and at most; tables and charts are apart."""


@dataclass
class PackedScenes:
    """Packed scenes of a page.

    scenes:  the text of every scene. places: case -> number of its scene.
    reasons: case -> why it has no scene, of those that were to have one.
    failures: case -> method, status, message of every answer of it that is not to be seen.
    lively:  case -> how much there is to see: speed of the source's joints while it is upright.
    notes:   sentences for people who look for more.
    """

    scenes: list[str] = field(default_factory=list)
    places: dict[Chosen, int] = field(default_factory=dict)
    lively: dict[Chosen, float] = field(default_factory=dict)
    reasons: dict[Chosen, str] = field(default_factory=dict)
    failures: dict[Chosen, list[tuple[str, str, str]]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def motions(
    chapters: Sequence[Chapter],
    chosen: Sequence[Chosen],
    room: int = MOST_ROOM,
    skins: bool = False,
    over: Over = iter,
) -> PackedScenes:
    """The scenes of these cases, in this order until the room is used up.

    room: bytes. skins: with meshes of bodies that have one.
    """
    result = PackedScenes()
    used = 0
    for number, each in enumerate(over(chosen)):
        chapter = chapters[each[0]]
        split = chapter.splits[each[1]]
        case = split.matrix.cases[each[2]].id
        try:
            if isinstance(chapter.bodies, BenchError):
                raise chapter.bodies
            places = [row.paths for row in split.matrix.rows]
            scene = scene_builder.of_case(places, case, dataset=chapter.data)
            if skins:
                scene = scene_builder.dressed(scene)
            text = player.data(packed(scene, IN_PAGES if skins else 0))
        except BenchError as error:
            result.reasons[each] = str(error)
            continue
        if used + len(text.encode()) > room and result.scenes:
            hint = " (--clips N takes in more)" if room < MOST_ROOM else ""
            result.notes.append(
                f"{count(len(chosen) - number, 'more case')} would have taken more than "
                f"{room / 1e6:.0f} MB of motion and were left out{hint}."
            )
            break
        used += len(text.encode())
        result.places[each] = len(result.scenes)
        result.lively[each] = _liveliness(scene)
        result.scenes.append(text)
        answers = [figure for figure in scene.figures if figure.part == "prediction"]
        paired = any(figure.part == scene_builder.REFERENCE for figure in scene.figures)
        answering = [label for label in split.labels if not (paired and label == scene_builder.REFERENCE)]
        result.failures[each] = [
            (label, figure.status, figure.message)
            for label, figure in zip(answering, answers, strict=True)
            if figure.positions is None
        ]
    result.notes += _notes(chapters, result)
    return result


def _liveliness(scene: Scene) -> float:
    """Heights per second of the source's joints on average, over the frames in which it is upright."""
    figure = next((each for each in scene.figures if each.part == "source"), None)
    if figure is None or figure.positions is None or len(figure.positions) < 2:
        return 0.0
    height = max(figure.character.height, 1e-6)
    upright = np.ptp(figure.positions[1:, :, 1], axis=1) > 0.75 * height  # (frames - 1,)
    speeds = np.linalg.norm(np.diff(figure.positions, axis=0), axis=-1).mean(axis=1) * scene.fps / height
    return float((speeds * upright).mean())


def _notes(chapters: Sequence[Chapter], scenes: PackedScenes) -> list[str]:
    """Reasons why cases have no scene, each once; and a hint where there are no predictions at all."""
    notes = []
    for why in dict.fromkeys(scenes.reasons.values()):
        cases = [each for each in scenes.reasons if scenes.reasons[each] == why]
        notes.append(f"{count(len(cases), 'case')} cannot be shown: {why}")
    places = [place for chapter in chapters for place in chapter.places]
    stored = [place for place in places if (place.folder / place.method).is_dir()]
    if not stored:
        notes.append(
            "Predictions are not stored beside these results, so no answer can be seen in motion. The "
            "command that made the results (listed below the tables) makes them again with --overwrite "
            "always; then make this report anew."
        )
    return notes
