"""What is edited around a method, and the order of it."""

from collections.abc import Callable
from dataclasses import replace
from typing import cast

from retarget_bench.motion import transfer
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.editing import fingers, floor, legs, loops, path, twists
from retarget_bench.motion.editing import start as starts
from retarget_bench.motion.editing.fingers import Hands
from retarget_bench.motion.editing.path import RootMotion
from retarget_bench.motion.editing.start import Starts
from retarget_bench.options import OptionSet, option

Answering = Callable[[Prediction, Character], Motion]
"""A method: the motion of a character for a source."""


class Edits(OptionSet):
    """What a user chooses; the defaults leave start and path as they are. Raises BenchError for others."""

    start: Starts = option(
        "Of a source that begins with a T-pose or elsewhere: keep it, cut it off (fewer frames), or ease "
        "it into the motion.",
        default="keep",
    )
    root_motion: RootMotion = option(
        "keep, in-place, or the axis to travel along: x, -x, z, -z.", default="keep", metavar="PATH"
    )
    hands: Hands = option(
        "Where the source shows no fingers and the target has them: relaxed, or open (as they rest).",
        default="relaxed",
    )


USUAL = Edits()


def begun(source: Prediction, edits: Edits) -> Prediction:
    """The source with the start that is wanted."""
    if edits.start == "keep" or (found := starts.find(source)) is None:
        return source
    return starts.cut(source, found) if edits.start == "cut" else starts.eased(source, found)


def compared(source: Motion, edits: Edits) -> Motion:
    """The source with the start and the path of its results, to be shown or compared with these."""
    return path.edited(cast(Motion, begun(source, edits)), edits.root_motion)


def doubts(source: Prediction, edits: Edits) -> tuple[str, ...]:
    """Sentences on a start that was kept and does not belong to the motion, and what to say for another."""
    found = starts.find(source) if edits.start == "keep" else None
    return (f"{source.character.name}: {found}: say {' or '.join(found.options)}",) if found else ()


def edited(
    source: Prediction, target: Character, edits: Edits, answer: Answering, posed: bool = True
) -> tuple[Motion, list[str]]:
    """The answer of a method to a source, edited; and sentences on what was done unasked.

    answer: the method. It is asked with the edited source, and again with the source going on where that is
            a loop and the answer is none.
    posed:  it is asked with reference poses that fit two bodies which do not stand alike (``legs``). What
            was trained on the common one is not.
    """
    source = begun(source, edits)
    loop = source if isinstance(source, Motion) and loops.is_loop(source) else None
    theirs, ours = legs.alike(source.character, target) if posed else (source.character, target)

    def asked(one: Prediction) -> Motion:
        found = answer(replace(one, character=theirs), ours)
        return target.motion(found.rotations, found.root, found.fps)

    differ = legs.stance(source.character) != legs.stance(target)

    sunk: list[bool] = []

    def mended(one: Prediction) -> Motion:
        found = asked(one)
        clear = floor.above(found) if differ else floor.no_deeper(found, one)
        sunk.append(clear is not found)
        return clear

    found = mended(source)
    if loop is not None and not loops.agrees(found, loop):
        whole, own = loops.continued(loop)
        found = mended(whole).at(own)
    found, notes = _parts(found, source, edits)
    if sunk[-1] and not differ:
        notes.append(
            f"the body of {target.name} is raised, or its arms bent, where head or hands were in the floor"
        )
    if loop is not None and not loops.agrees(found, loop):
        found = loops.closed(found)
    return path.edited(found, edits.root_motion), notes


def _parts(answer: Motion, source: Prediction, edits: Edits) -> tuple[Motion, list[str]]:
    """Fingers and twist bones, and what was done to them unasked."""
    target, notes = answer.character, []
    found = fingers.followed(answer, source)
    if edits.hands == "relaxed" and (relaxed := fingers.relaxed(found, source)) is not found:
        notes.append(f"{source.character.name} shows no fingers: the hands of {target.name} are relaxed")
        found = relaxed
    free = transfer.correspondence(source.character, target) < 0
    return twists.shared(found, free), notes
