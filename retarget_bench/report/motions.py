"""Packed scenes of a report, as many as fit, and notes on those left out."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from tqdm import tqdm

from retarget_bench.errors import BenchError
from retarget_bench.report.chapters import Chapter
from retarget_bench.report.choosing import Chosen
from retarget_bench.tables.model import count
from retarget_bench.viewer import player, scene_builder
from retarget_bench.viewer.packing import packed

ROOM = 10_500_000
"""Bytes of packed scenes in a page: with tables and charts it stays below 12 MB."""


@dataclass
class PackedScenes:
    """Packed scenes of a page.

    scenes:  the text of every scene. places: case -> number of its scene.
    reasons: case -> why it has no scene, of those that were to have one.
    gone:    case -> method, status, message of every answer of it that is not to be seen.
    notes:   sentences for people who look for more.
    """

    scenes: list[str] = field(default_factory=list)
    places: dict[Chosen, int] = field(default_factory=dict)
    reasons: dict[Chosen, str] = field(default_factory=dict)
    gone: dict[Chosen, list[tuple[str, str, str]]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def motions(
    chapters: Sequence[Chapter], chosen: Sequence[Chosen], room: int = ROOM, skins: bool = False
) -> PackedScenes:
    """The scenes of these cases, in this order until the room is used up; a bar shows how far it is.

    skins: with meshes of bodies that have one.
    """
    found = PackedScenes()
    used = 0
    for number, each in enumerate(
        tqdm(chosen, desc="packing motion", unit="case", leave=False, disable=None)
    ):
        chapter = chapters[each[0]]
        split = chapter.splits[each[1]]
        case = split.matrix.cases[each[2]].id
        if chapter.absent:
            found.reasons[each] = chapter.absent
            continue
        try:
            places = [row.paths for row in split.matrix.rows]
            scene = scene_builder.of_case(places, case, dataset=chapter.data)
            text = player.data(packed(scene, skins))
        except BenchError as error:
            found.reasons[each] = str(error)
            continue
        if used + len(text.encode()) > room and found.scenes:
            found.notes.append(
                f"{count(len(chosen) - number, 'more case')} would have made this file larger than "
                f"{(room + 1_500_000) / 1e6:.0f} MB and were left out."
            )
            break
        used += len(text.encode())
        found.places[each] = len(found.scenes)
        found.scenes.append(text)
        answers = [figure for figure in scene.figures if figure.part == "prediction"]
        found.gone[each] = [
            (label, figure.status, figure.message)
            for label, figure in zip(split.labels, answers, strict=True)
            if figure.positions is None
        ]
    found.notes += _notes(chapters, found)
    return found


def _notes(chapters: Sequence[Chapter], found: PackedScenes) -> list[str]:
    """Why cases have no scene, each reason once; and how to get predictions where there are none at all."""
    notes = []
    for why in dict.fromkeys(found.reasons.values()):
        cases = [each for each in found.reasons if found.reasons[each] == why]
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
