"""Spellings of body parts in rigs: a table from name stems to roles, and the cutting of names into stems.

A name is cut into a side (left, right or none), a stem (lower case letters) and numbers. What a stem can
mean is listed best meaning first; where it can mean two things (``LeftHip`` is the upper leg in one rig
and a helper above it in another), the joints around it decide (``roles.py``).
"""

import re
from dataclasses import dataclass

LIMBS: dict[str, tuple[str, ...]] = {
    "arm": ("shoulder", "arm", "forearm", "hand"),
    "leg": ("up_leg", "leg", "foot", "toe", "toe_end"),
}
"""The chain of roles of each limb, from the body outwards."""

LIMB_STEMS: dict[str, tuple[str, ...]] = {
    "clavicle": ("shoulder",),
    "collar": ("shoulder",),
    "collarbone": ("shoulder",),
    "scapula": ("shoulder",),
    "shoulder": ("shoulder", "arm"),
    "arm": ("arm",),
    "uparm": ("arm",),
    "upperarm": ("arm",),
    "armupper": ("arm",),
    "humerus": ("arm",),
    "forearm": ("forearm",),
    "loarm": ("forearm",),
    "lowerarm": ("forearm",),
    "armlower": ("forearm",),
    "elbow": ("forearm",),
    "radius": ("forearm",),
    "wrist": ("hand",),
    "hand": ("hand",),
    "palm": ("hand",),
    "upleg": ("up_leg",),
    "upperleg": ("up_leg",),
    "legupper": ("up_leg",),
    "thigh": ("up_leg",),
    "femur": ("up_leg",),
    "hip": ("up_leg",),
    "leg": ("leg", "up_leg"),
    "loleg": ("leg",),
    "lowerleg": ("leg",),
    "leglower": ("leg",),
    "calf": ("leg",),
    "shin": ("leg",),
    "tibia": ("leg",),
    "knee": ("leg",),
    "ankle": ("foot",),
    "foot": ("foot", "toe"),
    "toe": ("toe",),
    "toes": ("toe",),
    "toebase": ("toe",),
    "ball": ("toe",),
    "toeend": ("toe_end",),
    "toesend": ("toe_end",),
    "toebaseend": ("toe_end",),
    "toenub": ("toe_end",),
}
"""Stems of joints that have a side -> roles without the side, best meaning first."""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


SPINE_STEMS = _words("spine chest upperchest lowerback upperback midback back waist thorax torso abdomen")
NECK_STEMS = _words("neck lowerneck upperneck necktwist")
HEAD_STEMS = _words("head")
HEAD_TOP_STEMS = _words("headtop headtopend headend headnub topofhead")
TAIL_STEMS = _words("tail")
HIPS_STEMS = _words("hips hip pelvis root boneroot cog")
FINGERS = {
    "thumb": "thumb",
    "index": "index",
    "middle": "middle",
    "mid": "middle",
    "ring": "ring",
    "pinky": "pinky",
    "pinkie": "pinky",
    "little": "pinky",
}
NUMBERED_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
"""The fingers finger1 to finger5."""

HELPER_WORDS = _words(
    "helper twist share split roll dummy joint pelvis metacarpal metatarsal base fingers ik pole"
)
"""Names with one of these words belong to the body but carry no role: they follow their parent."""

EXTRA_WORDS = _words(
    "hair hat hood hoodie string jacket sleeve pant backpack strap bag pouch cape belly peck breast ribs"
    " jaw tongue teeth eye jowel facial face anim risorius temporalis oris levator oculi orbicularis"
    " special toe prop weapon collar skirt cloth ear brow lip cheek nose"
)
"""Names with one of these words are clothes, hair, props, parts of the face or single toes."""

_PREFIX = re.compile(
    r"^(?:.*:|cc_base_|mixamorig\d*_?|bip\d*[ _]?|rl_|b_(?=[lr]_|[a-z]{3})|def-|bind_)", re.I
)
_WORD = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
_LEFT = frozenset(("left", "l", "lft"))
_RIGHT = frozenset(("right", "r", "rgt"))


@dataclass(frozen=True)
class Name:
    """A joint's name, cut up. ``side`` is "left", "right" or ""; a helper's stem is empty."""

    side: str
    stem: str
    numbers: tuple[int, ...] = ()
    words: tuple[str, ...] = ()

    @property
    def number(self) -> int | None:
        return self.numbers[-1] if self.numbers else None


def read(name: str) -> Name:
    """Cut a joint's name up: ``mixamorig:LeftHandThumb2`` -> side left, stem handthumb, number 2."""
    bare = strip_prefix(name)
    if bare.startswith("__"):
        return Name("", "helper", words=("helper",))
    words = _WORD.findall(bare)
    letters = [word.lower() for word in words if not word.isdigit()]
    numbers = tuple(int(word) for word in words if word.isdigit())
    side = ""
    for word in (letters[:1], letters[-1:]):
        if not side and len(letters) > 1 and word and (found := _side(word[0])):
            side = found
            letters.remove(word[0])
    stem = "".join(letters)
    if not side and len(letters) == 1 and stem[:1] in "lr" and knows_limb(stem[1:]):
        side, stem = ("left" if stem[0] == "l" else "right"), stem[1:]
    return Name(side, stem, numbers, tuple(letters))


def strip_prefix(name: str) -> str:
    """The name without name space and rig prefix: ``newVegas:Hips`` and ``CC_Base_Hips`` -> ``Hips``."""
    bare = _PREFIX.sub("", name.strip())
    return bare or name


def knows_limb(stem: str) -> bool:
    return stem in LIMB_STEMS or finger_of(stem) is not None or stem in ("hipjoint", "fingers")


def finger_of(stem: str) -> str | None:
    """The finger that a stem names: ``handthumb`` -> thumb."""
    return FINGERS.get(stem.removeprefix("hand"))


def _side(word: str) -> str:
    return "left" if word in _LEFT else "right" if word in _RIGHT else ""
