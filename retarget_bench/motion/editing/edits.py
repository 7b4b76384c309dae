"""The edits around a method, and their order."""

from collections.abc import Callable
from dataclasses import replace
from typing import cast

from retarget_bench.motion import transfer
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.editing import arms, fingers, floor, legs, loops, path, twists
from retarget_bench.motion.editing import start as starts
from retarget_bench.motion.editing.arms import Arms
from retarget_bench.motion.editing.fingers import Hands
from retarget_bench.motion.editing.path import RootMotion
from retarget_bench.motion.editing.start import Starts
from retarget_bench.options import OptionSet, option

Answering = Callable[[Prediction, Character], Motion]
"""A method: the motion of a character for a source."""


class Edits(OptionSet):
    """The user's choices; the defaults leave start and path as they are. Raises BenchError for others."""

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
    arms: Arms = option(
        "Hands and forearms that would go into trunk or legs of a target with a skin, where the source's "
        "hand is free: clear (arms are turned out, known as arm space), or keep.",
        default="clear",
    )


USUAL = Edits()


def begun(source: Prediction, edits: Edits) -> Prediction:
    """The source with the chosen start."""
    if edits.start == "keep" or (start := starts.find(source)) is None:
        return source
    return starts.cut(source, start) if edits.start == "cut" else starts.eased(source, start)


def compared(source: Motion, edits: Edits) -> Motion:
    """The source with the start and the path of its results, to be shown or compared with these."""
    return path.edited(cast(Motion, begun(source, edits)), edits.root_motion)


def doubts(source: Prediction, edits: Edits) -> tuple[str, ...]:
    """Sentences on a start that was kept and does not belong to the motion, and the options that change
    it."""
    start = starts.find(source) if edits.start == "keep" else None
    return (f"{source.character.name}: {start}: say {' or '.join(start.options)}",) if start else ()


def edited(
    source: Prediction, target: Character, edits: Edits, answer: Answering, posed: bool = True
) -> tuple[Motion, list[str]]:
    """The answer of a method to a source, edited; and sentences on what was changed unasked.

    answer: the method. It is called with the edited source, and again with the source going on where that
            is a loop and the answer is none.
    posed:  it is called with reference poses that fit two bodies which do not stand alike (``legs``). What
            was trained on the common one is not.
    """
    source = begun(source, edits)
    loop = source if isinstance(source, Motion) and loops.is_loop(source) else None
    source_body, target_body = legs.alike(source.character, target) if posed else (source.character, target)

    def retargeted(one: Prediction) -> Motion:
        motion = answer(replace(one, character=source_body), target_body)
        return target.motion(motion.rotations, motion.root, motion.fps)

    differ = legs.stance(source.character) != legs.stance(target)

    sunk: list[bool] = []

    def mended(one: Prediction) -> Motion:
        motion = retargeted(one)
        clear = floor.above(motion, one) if differ else floor.no_deeper(motion, one)
        sunk.append(clear is not motion)
        return clear

    motion = mended(source)
    if loop is not None and not loops.agrees(motion, loop):
        extended, own = loops.continued(loop)
        motion = mended(extended).at(own)
    motion, notes = _parts(motion, source, edits, loop is not None and loops.is_loop(motion))
    if sunk[-1] and not differ:
        notes.append(
            f"the body of {target.name} is raised, or its arms bent, where head or hands were in the floor"
        )
    if loop is not None and not loops.agrees(motion, loop):
        motion = loops.closed(motion)
    return path.edited(motion, edits.root_motion), notes


def _parts(answer: Motion, source: Prediction, edits: Edits, loop: bool) -> tuple[Motion, list[str]]:
    """Fingers, arms and twist bones, and what was done to them unasked. loop: the answer is one."""
    target = answer.character
    notes: list[str] = []
    motion = fingers.followed(answer, source)
    if edits.hands == "relaxed" and (relaxed := fingers.relaxed(motion, source)) is not motion:
        notes.append(f"{source.character.name} shows no fingers: the hands of {target.name} are relaxed")
        motion = relaxed
    stances = {legs.stance(each) for each in (source.character, target)}
    if edits.arms == "clear" and stances == {"two legs"}:
        motion, note = arms.cleared(motion, source, loop)
        notes += [note] if note else []
    free = transfer.correspondence(source.character, target) < 0
    return twists.shared(motion, free), notes
