"""Who performs: three characters of each structure, with three ways of drawing a rest pose."""

from __future__ import annotations

from .bodies import Body
from .proportions import STATURE, human
from .structures import BODY22, BODY28

_WOMAN, _WOMAN_SPREAD = STATURE["woman"]
_MAN, _MAN_SPREAD = STATURE["man"]

CAST = (
    Body("ada", BODY22, human("woman", _WOMAN), rest="t_pose"),
    # a man with long thighs and forearms
    Body(
        "boris",
        BODY22,
        human("man", _MAN).scaled(thigh=1.04, shank=0.95, upper_arm=0.97, forearm=1.05),
        rest="along_x",
    ),
    # big head and feet, short legs and arms
    Body(
        "pip",
        BODY22,
        human("man", 1.25).scaled(
            head=2.1,
            hand=1.2,
            girth=1.2,
            thigh=0.52,
            shank=0.64,
            ball=1.35,
            toes=1.35,
            heel=1.3,
            hip_half=1.25,
            upper_arm=0.88,
            forearm=0.78,
        ),
        rest="a_pose",
    ),
    # a tall woman with long shanks
    Body(
        "clara",
        BODY28,
        human("woman", _WOMAN + 2.0 * _WOMAN_SPREAD).scaled(thigh=0.97, shank=1.06, trunk=0.98),
        rest="t_pose",
    ),
    # very long arms over short, wide-set legs
    Body(
        "gibbon",
        BODY28,
        human("man", 1.50).scaled(
            upper_arm=1.45,
            forearm=1.65,
            hand=1.2,
            neck=0.8,
            thigh=0.80,
            shank=0.60,
            hip_half=1.3,
            waist_half=1.1,
            ball=1.2,
        ),
        rest="a_pose",
    ),
    # a giant: small head, broad chest, long shanks, small feet
    Body(
        "titan",
        BODY28,
        human("man", _MAN + 2.0 * _MAN_SPREAD).scaled(
            1.35,
            head=0.72,
            girth=1.2,
            shoulder_half=1.45,
            trunk=1.10,
            hip_half=1.3,
            waist_half=1.15,
            thigh=0.82,
            shank=1.22,
            ball=0.75,
            toes=0.75,
            heel=0.75,
            upper_arm=1.15,
            forearm=0.95,
        ),
        rest="along_x",
    ),
)

BODIES = {body.name: body for body in CAST}
