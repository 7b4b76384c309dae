"""Squatting, touching the floor, and lifting a box that is not there."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...conventions import FPS, SIDES
from ...curves import bump, plateau, ramp, wander
from ...randomness import Stream
from ..score import Foot, Hand, HandContact, Score, Touch
from .arms import Shape, Triple
from .scene import STEP, Scene, shifting, slots, small_step, stance
from .sequencing import cut
from .style import Performer, along, hanging, rows

Times = Sequence[tuple[float, float, float, float]]
"""Per squat the seconds at which it begins, is deep, ends to be deep, and is over."""


def squat(stream: Stream, frames: int) -> Score:
    """Squatting down with the weight over both feet, a moment at the bottom, and up."""
    arms = stream.choice(("forward", "knees", "hips", "clasped"))
    steps_out = stream.choice((True, False))
    # a wider stance is taken first
    first = (6.0 + STEP) / FPS if steps_out else 0.0
    count = max(1, int((frames / FPS - first) / 2.2))
    share = (frames / FPS - first) / count
    times = []
    for k in range(count):
        begin = first + share * (k + stream.uniform(0.04, 0.10))
        later = (stream.uniform(*pair) for pair in ((0.30, 0.36), (0.46, 0.56), (0.78, 0.86)))
        deep_from, deep_to, over = (begin + share * part for part in later)
        times.append((begin, deep_from, deep_to, over))
    knees = arms == "knees"
    deep = stream.uniform(0.66, 0.74) if knees else stream.uniform(0.50, 0.70)
    lean = stream.uniform(0.70, 0.84) if knees else stream.uniform(0.45, 0.75)
    toes, width = stream.choice((0.0, 0.0, 0.35)), stream.uniform(1.3, 2.0)
    person = Performer(stream, frames)
    person.style = replace(person.style, toe_out=person.style.toe_out + stream.uniform(0.05, 0.25))
    heading = stream.uniform(-np.pi, np.pi)
    t, still = person.t, np.zeros(frames)
    down = sum((plateau(t, *each) for each in times), start=still)
    rising = sum((plateau(t, up - 0.25, up + 0.1, up + 0.3, up + 0.7) for *_, up in times), start=still)
    support, side = shifting(stream, frames, 0.08), stream.choice(SIDES)
    feet = stance(heading, person.style, frames, support, 0.6 * width if steps_out else width)
    if steps_out:
        # the whole difference is made by one foot; the balance brings the body between both
        feet = small_step(feet, side, 5, wider=0.8 * width)
    # heels rise together
    heel = toes * rising
    feet = replace(feet, feet={side: Foot(foot.contacts, heel) for side, foot in feet.feet.items()})
    trunk = person.trunk(
        pelvis=(0.0, 0.03 + 0.55 * lean * down, 0.0),
        chest=(0.0, 0.45 * lean * down, 0.0),
        gaze=(0.0, 0.22 * lean * down, 0.0),
    )
    hands = {side: _hand(person, arms, times, down, side) for side in SIDES}
    return feet.score("squat", 0.994 - (0.994 - deep) * down + 0.3 * heel, trunk, hands)


def _hand(person: Performer, arms: str, times: Times, down: np.ndarray, side: str) -> Hand:
    frames, still = person.frames, np.zeros(person.frames)
    if arms == "knees":
        # on the thigh just over the knee while the trunk is low
        held = [(a + 0.25 * (b - a), b - 0.05, c + 0.1, d - 0.2 * (d - c)) for a, b, c, d in times]
        resting = sum((plateau(person.t, *each) for each in held), start=still)
        calm = person.idle_hand((Touch(f"{side}_knee", resting),))
        reached = plateau(person.t, times[0][0], times[0][1], *times[-1][2:])
        reach = calm.reach + reached[:, None] * np.array([0.0, 0.12, 0.25])
        return replace(calm, reach=reach, upright=still + 1.0, swivel=calm.swivel + 0.35 * resting)
    if arms == "hips":
        calm = person.idle_hand((Touch(f"{side}_hip", still + 1.0),))
        return replace(calm, swivel=calm.swivel + 0.6)
    if arms == "clasped":
        # palm to palm before the chest, fingers ahead and up
        reach = rows(frames, 0.03, -0.30 + 0.08 * down + person.wander(0.015), 0.58 + 0.06 * down)
        touches = (Touch("left_palm", still + 1.0),) if side == "right" else ()
        folded = person.hand(reach, upright=0.5, middle=1.0, touches=touches)
        return replace(
            folded, aim=np.tile([-1.0, 0.0, 0.0, 0.0, 0.45, 0.9], (frames, 1)), aimed=still + 1.0
        )
    # stretched out in front as a counterweight, a little ahead of the squat
    hang = hanging(person.wander(0.03), person.style.aside + still, person.style.elbow + still)
    out = np.array([0.06, -0.06 + 0.1 * person.style.posture, 0.93])
    share = down * (2.0 - down)
    reach = hang + share[:, None] * (out - hang) + person.wander(0.012)[:, None]
    return person.hand(reach, upright=1.0, swivel=0.25 * share)


def touch_floor(stream: Stream, frames: int) -> Score:
    """Touching the floor with one hand or both, stooping with all but straight knees or squatting."""
    scene = Scene(stream, max(frames, 80), width=stream.uniform(1.3, 1.9), shift=0.1, loose=0.3)
    how, hands = stream.choice(("stoop", "squat")), stream.choice((SIDES, SIDES, ("left",), ("right",)))
    place = along(scene.heading, stream.uniform(0.25, 0.32))
    for start, end in slots(stream, scene.frames, 2.7, 4.2):
        down = min(40.0, 0.44 * (end - start))
        bent = scene.held(start, start + down, end - down, end)
        scene.low += (0.14 if how == "stoop" else 0.38) * bent
        scene.lean(bent, *((0.88, 0.64, 1.15) if how == "stoop" else (0.42, 0.62, 0.75)))
        stay = HandContact(
            place,
            scene.heading,
            round(start + down),
            round(end - down),
            coming=round(0.62 * down),
            leaving=round(0.62 * down),
            width=0.75,
            turned=-0.15,
            tilt=1.25,
            crouch=True,
        )
        for side in hands:
            scene.contacts[side].append(stay)
            reaching = Shape((0.0, -0.75, 0.52), swivel=0.15, upright=1.0)
            scene.arm(side, start + 0.1 * down, start + 0.8 * down, reaching)
            scene.arm(side, end - 0.8 * down, end)
    return cut(scene.score("touch_floor"), 0, frames)


_DOWN, _GRIP, _UP = 44, 6, 46
"""Frames of going down, of taking or letting go, of going up."""


def lift(stream: Stream, frames: int) -> Score:
    """Down by the knees or the back, both hands to the box, up with it; where there is time, down again."""
    round_trip = 4 * (_DOWN + _GRIP) + 20
    back = frames >= round_trip
    length = frames if back else max(frames, _DOWN + _GRIP + _UP + 16)
    scene = Scene(stream, length, width=stream.uniform(1.3, 1.8), shift=0.1, loose=0.3)
    how = stream.choice(("squat", "squat", "stoop"))
    ahead, half = stream.uniform(0.34, 0.42), stream.uniform(0.26, 0.36)
    level, carried = stream.uniform(0.34, 0.46), (stream.uniform(-0.52, -0.36), stream.uniform(0.50, 0.62))
    start = 6
    grip = start + _DOWN
    taking = HandContact(
        along(scene.heading, ahead),
        scene.heading,
        grip,
        grip + _GRIP,
        round(0.6 * _DOWN),
        round(0.75 * _UP),
        width=0.0,
        apart=half,
        level=level,
        crouch=True,
    )
    contacts = [taking]
    ends: tuple[float, float] = (1e6, 1e6 + 1.0)
    bent = scene.held(start, grip, grip + _GRIP, grip + _GRIP + _UP)
    if back:
        put = length - 6 - _UP - _GRIP
        coming, leaving = round(0.75 * _DOWN), round(0.6 * _UP)
        contacts.append(replace(taking, strike=put, off=put + _GRIP, coming=coming, leaving=leaving))
        bent = bent + scene.held(put - _DOWN, put, put + _GRIP, put + _GRIP + _UP)
        ends = (put + _GRIP, put + _GRIP + 0.8 * _UP)
    scene.low += (0.32 if how == "squat" else 0.14) * bent
    scene.lean(bent, *((0.40, 0.62, 0.50) if how == "squat" else (0.95, 0.60, 0.95)))
    holding = plateau(scene.k, start + 0.1 * _DOWN, start + 0.9 * _DOWN, *ends)
    held = holding * ramp(scene.k, grip, grip + _UP)
    scene.lean(held * (1.0 - bent), -0.05, -0.08)
    hands = _both_hands(scene, (half, *carried), holding, tuple(contacts))
    score = replace(scene.score("lift"), hands=hands)
    return cut(score, 0 if back else stream.choice((0, length - frames)), frames)


def _both_hands(
    scene: Scene, carried: Triple, holding: np.ndarray, contacts: tuple[HandContact, ...]
) -> dict[str, Hand]:
    """Hands at ease, then as far apart as the box is wide, whatever else happens. carried: where the wrists
    hold it before the body (out, up, forward), arm lengths."""
    frames, small = scene.frames, [wander(scene.stream, scene.t, 0.008) for _ in range(2)]
    held = np.array(carried) + rows(frames, 0.0, *small)
    out = bump(holding)[:, None] * np.array([0.10, 0.0, 0.05])
    hands = {}
    for side in SIDES:
        hang = scene.hang(0.03, 0.02, 0.05)
        hands[side] = Hand(
            reach=hang + holding[:, None] * (held - hang) + out,
            upright=0.7 + 0.3 * holding,
            middle=holding,
            swivel=0.15 * holding,
            wrist=rows(frames, 0.18, 0.0, 0.0),
            aim=np.tile([-1.0, 0.0, 0.0, 0.0, -0.35, 0.94], (frames, 1)),
            aimed=holding,
            contacts=contacts,
        )
    return hands
