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
    stem: tuple(roles.split())
    for roles, stems in (
        ("shoulder", "clavicle collar collarbone scapula"),
        ("shoulder arm", "shoulder"),
        ("arm", "arm uparm upperarm armupper humerus"),
        ("forearm", "forearm loarm lowerarm armlower elbow radius"),
        ("hand", "wrist hand palm"),
        ("arm forearm hand", "wing wingbone"),
        ("up_leg", "upleg upperleg legupper thigh femur hip"),
        ("leg up_leg", "leg"),
        ("leg", "loleg lowerleg leglower calf shin tibia knee"),
        ("foot", "ankle"),
        ("foot toe", "foot"),
        ("toe", "toe toes toebase ball"),
        ("toe_end", "toeend toesend toebaseend toenub"),
    )
    for stem in stems.split()
}
"""Stems of joints that have a side -> roles without the side, best meaning first."""

HOCK_STEMS = frozenset(("horselink", "hock", "cannon", "metatarsus", "tarsus"))
HOCKED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(HOCK_STEMS, ("foot",)),
    "foot": ("toe",),
    "toe": ("toe_end",),
    "toes": ("toe_end",),
}
"""Meanings on a side whose leg has a joint for the hock of its own: the foot begins there, as in rigs of
animals whose foot is one bone, and what hangs below it is one role farther out."""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


SPINE_STEMS = _words("spine chest upperchest lowerback upperback midback back waist thorax torso abdomen")
TAIL_STEMS = _words("tail tailbase tailroot tailbone")
NECK_STEMS = _words("neck lowerneck upperneck necktwist")
HEAD_TOP_STEMS = _words("headtop headtopend headend headnub topofhead")
HIPS_STEMS = _words("hips hip pelvis root boneroot cog")
NUMBERED_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
"""The fingers finger1 to finger5."""
FINGERS = {name: name for name in NUMBERED_FINGERS} | {
    "mid": "middle",
    "pinkie": "pinky",
    "little": "pinky",
}

HELPER_WORDS = _words(
    "helper twist share split roll dummy joint pelvis metacarpal metatarsal base finger fingers ik pole nub"
)
"""Names with one of these words belong to the body but carry no role: they follow their parent."""

EXTRA_WORDS = _words(
    "hair hat hood hoodie string jacket sleeve pant backpack strap bag pouch cape belly peck breast ribs"
    " jaw tongue teeth eye jowel facial face anim risorius temporalis oris levator oculi orbicularis"
    " special toe prop weapon collar skirt cloth ear ears brow lip cheek nose"
    " beak bill crest comb wattle feather feathers mane udder horn tusk"
)
"""Names with one of these words are clothes, hair, props, parts of the face or single toes."""

_PREFIX = re.compile(
    r"^(?:.*:|cc_base_|mixamorig\d*_?|bip\d*[ _]?|rl_|b_(?=[lr]_|[a-z]{3})|def-|bind_|bn_|jnt_|npc[ _])+",
    re.I,
)
_WORD = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
_SIDES = {"left": "left", "l": "left", "lft": "left", "right": "right", "r": "right", "rgt": "right"}


@dataclass(frozen=True)
class Name:
    """A joint's name, cut up. ``side`` is "left", "right" or ""; a helper's stem is empty."""

    side: str
    stem: str
    numbers: tuple[int, ...] = ()
    words: tuple[str, ...] = ()


def read(name: str) -> Name:
    """Cut a joint's name up: ``mixamorig:LeftHandThumb2`` -> side left, stem handthumb, number 2."""
    bare = strip_prefix(name)
    if bare.startswith("__"):
        return Name("", "helper", words=("helper",))
    cut = words(bare)
    letters = [word for word in cut if not word.isdigit()]
    numbers = tuple(int(word) for word in cut if word.isdigit())
    side = ""
    for word in (letters[:1], letters[-1:]):
        if not side and len(letters) > 1 and word and (candidate := _SIDES.get(word[0])):
            side = candidate
            letters.remove(word[0])
    stem = "".join(letters)
    if not side and len(letters) == 1 and stem[:1] in "lr" and _is_limb(stem[1:]):
        side, stem = _SIDES[stem[0]], stem[1:]
        letters = [stem]
    return Name(side, stem, numbers, tuple(letters))


def words(text: str) -> list[str]:
    """Words and numbers of a name, in lower case: ``HorseRun_02`` -> horse, run, 02."""
    return [word.lower() for word in _WORD.findall(text)]


def strip_prefix(name: str) -> str:
    """The name without name space and rig prefix: ``newVegas:Hips`` and ``CC_Base_Hips`` -> ``Hips``."""
    bare = _PREFIX.sub("", name.strip())
    return bare or name


def _is_limb(stem: str) -> bool:
    return stem in LIMB_STEMS or finger_of(stem) is not None or stem in ("hipjoint", "fingers")


def finger_of(stem: str) -> str | None:
    """The finger that a stem names: ``handthumb`` -> thumb."""
    return FINGERS.get(stem.removeprefix("hand"))
