"""Who performs: three characters of each structure, with three ways of drawing a rest pose."""

from __future__ import annotations

from .bodies import Body
from .proportions import STATURE, human
from .structures import BODY22, BODY28

_WOMAN, _WOMAN_SPREAD = STATURE["woman"]
_MAN, _MAN_SPREAD = STATURE["man"]

CAST = (
    Body("ada", BODY22, human("woman", _WOMAN), rest="t_pose"),
    Body("boris", BODY22, human("man", _MAN), rest="along_x"),
    # big head, short legs and arms
    Body(
        "pip",
        BODY22,
        human("man", 1.25).scaled(
            thigh=0.62,
            shank=0.66,
            trunk=0.95,
            head=2.1,
            hand=1.2,
            upper_arm=0.85,
            forearm=0.85,
            girth=1.2,
            ball=1.2,
            toes=1.2,
        ),
        rest="a_pose",
    ),
    # a tall woman, two standard deviations over the mean
    Body("clara", BODY28, human("woman", _WOMAN + 2.0 * _WOMAN_SPREAD).scaled(shank=1.04), rest="t_pose"),
    # very long arms on short, wide-set legs
    Body(
        "gibbon",
        BODY28,
        human("man", 1.50).scaled(
            upper_arm=1.45, forearm=1.55, thigh=0.80, shank=0.74, hip_half=1.15, hand=1.15, neck=0.8
        ),
        rest="a_pose",
    ),
    # a giant: small head, broad chest, long shanks
    Body(
        "titan",
        BODY28,
        human("man", _MAN + 2.0 * _MAN_SPREAD).scaled(
            1.35,
            head=0.72,
            shoulder_half=1.35,
            trunk=1.08,
            shank=1.10,
            thigh=0.95,
            upper_arm=1.05,
            hip_half=1.15,
            waist_half=1.1,
            girth=1.2,
        ),
        rest="along_x",
    ),
)

BODIES = {body.name: body for body in CAST}
