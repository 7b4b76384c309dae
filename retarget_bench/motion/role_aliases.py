"""Spellings of body parts in rigs: a table from name stems to roles, and the cutting of names into stems.

The names of a skeleton are read together: words that nearly all of them begin or end with (a rig's prefix)
are dropped. Each is cut into a side (left, right or none), a stem (lower case letters without accents) and
numbers. What a stem can mean is listed best meaning first; where it can mean two things (``LeftHip`` is the
upper leg in one rig and a helper above it in another), the joints around it decide (``role_finding.py``).
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

LIMBS: dict[str, tuple[str, ...]] = {
    "arm": ("shoulder", "arm", "forearm", "hand"),
    "leg": ("up_leg", "leg", "foot", "toe", "toe_end"),
}
"""The chain of roles of each limb, from the body outwards."""


def fold(text: str) -> str:
    """The text without accents, in one width of letters: ``Épaule`` -> ``Epaule``, ``ﾋｻﾞ`` -> ``ヒサ``."""
    decomposed = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return "".join(letter for letter in decomposed if not unicodedata.combining(letter))


def _words(text: str) -> frozenset[str]:
    return frozenset(fold(text).split())


LIMB_STEMS: dict[str, tuple[str, ...]] = {
    stem: tuple(roles.split())
    for roles, stems in (
        (
            "shoulder",
            "clavicle clav collar collarbone scapula schlüsselbein clavicule clavícula 锁骨 ключица",
        ),
        ("shoulder arm", "shoulder shldr schulter épaule hombro 肩 плечо spalla ombro schouder"),
        ("arm forearm", "arm bras brazo рука braccio braço"),
        ("arm", "uparm upperarm armupper uarm humerus oberarm 腕 上腕 上臂 大臂 bovenarm"),
        ("forearm", "forearm loarm lowarm lowerarm armlower farm elbow radius"),
        (
            "forearm",
            "unterarm ellbogen avantbras coude antebrazo codo avambraccio gomito antebraço cotovelo",
        ),
        ("forearm", "onderarm ひじ 肘 前腕 前臂 小臂 предплечье локоть"),
        ("hand", "wrist hand palm handgelenk main poignet mano muñeca polso pulso mão"),
        ("hand", "手首 手 手腕 手掌 кисть"),
        ("arm forearm hand", "wing wingbone"),
        ("up_leg", "upleg upperleg legupper thigh femur hip"),
        ("up_leg", "oberschenkel hüfte cuisse hanche muslo cadera coscia anca coxa bovenbeen"),
        ("up_leg", "大腿 もも 太もも бедро"),
        ("leg up_leg", "leg bein jambe pierna нога gamba perna"),
        ("up_leg leg foot", "足 脚"),
        ("leg", "loleg lowleg lowerleg leglower calf shin tibia knee"),
        ("leg", "unterschenkel knie mollet genou pantorrilla rodilla ginocchio joelho onderbeen"),
        ("leg", "ひざ 膝 すね 小腿 голень колено"),
        ("foot", "ankle knöchel fußgelenk cheville tobillo caviglia tornozelo enkel"),
        ("foot", "足首 脚踝 脚腕 лодыжка"),
        ("foot toe", "foot fuß pied pie стопа piede pé voet"),
        ("toe", "toe toes toebase ball bigtoe digit zeh zehe zehen orteil orteils punta dita dedos tenen"),
        ("toe", "つま先 脚趾 脚尖 носок"),
        ("toe_end", "toeend toesend toebaseend toenub toetip"),
    )
    for stem in fold(stems).split()
}
"""Stems of joints that have a side -> roles without the side, best meaning first."""

_FORE, _HIND = _words("front fore"), _words("back hind rear")
_AS_FORE_LEG = {"up_leg": "arm", "leg": "forearm", "foot": "hand"}
LIMB_STEMS |= {
    where + stem: tuple(_AS_FORE_LEG[role] if where in _FORE else role for role in roles)
    for stem, roles in tuple(LIMB_STEMS.items())
    for where in _FORE | _HIND
    if set(roles) <= _AS_FORE_LEG.keys()
}
"""Fore legs have the roles of arms."""

HOCK_STEMS = frozenset(("horselink", "hock", "cannon", "metatarsus", "tarsus"))
HOCKED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(HOCK_STEMS, ("foot",)),
    "foot": ("toe",),
    "toe": ("toe_end",),
    "toes": ("toe_end",),
}
"""Meanings on a side whose leg has a joint for the hock of its own: the foot begins there, as in rigs of
animals whose foot is one bone, and what hangs below it is one role farther out."""


SPINE_STEMS = _words(
    "spine chest upperchest lowerback upperback midback back waist thorax torso abdomen ribcage"
    " 上半身 脊柱 脊椎 胸"
)
TAIL_STEMS = _words("tail tailbase tailroot tailbone schwanz queue cola 尾 хвост")
NECK_STEMS = _words(
    "neck lowerneck upperneck neckupper necklower necktwist headnecklower hals cou cuello collo pescoço nek"
    " 首 颈 脖子 шея"
)
HEAD_STEMS = _words("head neckhead headneckupper kopf tête cabeza testa cabeça hoofd 頭 头 голова")
_TRUNK_STEMS = SPINE_STEMS | TAIL_STEMS | NECK_STEMS | HEAD_STEMS
HEAD_TOP_STEMS = _words("headtop headtopend headend headnub topofhead")
HIPS_STEMS = _words("hips hip pelvis root boneroot cog becken bassin caderas センター 腰 骨盆 таз")
NUMBERED_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
"""The fingers finger1 to finger5."""
_OF_FINGERS = _words("hand finger f")
"""Words beside the name of a finger."""
FINGERS = {name: name for name in NUMBERED_FINGERS} | {
    "mid": "middle",
    "pinkie": "pinky",
    "little": "pinky",
    "親指": "thumb",
    "人指": "index",
    "中指": "middle",
    "薬指": "ring",
    "小指": "pinky",
}

HELPER_WORDS = _words(
    "helper twist share split roll dummy joint pelvis carpal metacarpal metatarsal metatarsals base finger"
    " fingers ik pole nub"
)
"""Names with one of these words belong to the body but carry no role: they follow their parent."""

EXTRA_WORDS = _words(
    "hair hat hood hoodie string jacket sleeve pant backpack strap bag pouch cape belly peck breast ribs"
    " jaw tongue teeth eye jowel facial face anim risorius temporalis oris levator oculi orbicularis"
    " special toe prop weapon collar skirt cloth ear ears brow lip cheek nose"
    " beak bill crest comb wattle feather feathers mane udder horn tusk"
)
"""Names with one of these words are clothes, hair, props, parts of the face or single toes."""

DIVIDING_WORDS = _words("helper twist share split roll dummy to ik pole nub")
"""Of these, names of joints that divide a bone, or lie beside one, without a bend of their own."""

_PREFIX = re.compile(
    r"^(?:.*:|cc_base_|mixamorig\d*_?|valvebiped\.|bip\d*[ _]?|rl_|b_(?=[lr]_|[a-z]{3})|def-|bind_|bn_|jnt_"
    r"|j_(?:bip|sec|adj)_|npc[ _])+",
    re.I,
)
_BRACKETED = re.compile(r"\[.*\]$")
"""A short form behind a name: ``Pelvis [Pelv]``."""
_WORD = re.compile(
    r"(?<![A-Za-z])[LR](?=[A-Z]{2}[a-z])|[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+|[左右]|[^\W\d_A-Za-z左右]+"
)
_SIDES = {
    word: side
    for side, words in (
        (
            "left",
            "left l lf lt lft links linke gauche izquierda izquierdo izq esq sx sinistra 左 лев левая",
        ),
        (
            "right",
            "right r rt rgt rechts rechte droite droit derecha derecho der dir dx destra 右 прав правая",
        ),
    )
    for word in fold(words).split()
}
_MIDDLE = _words("c m x")
"""Letters for joints of neither side."""
_MODIFIERS = _words("bend stretch")
"""Words of the bone of a limb itself, where others stand for its twist."""
_NEARLY_ALL = 0.75
"""Share of the names that have a rig's prefix or suffix."""
_BODY, _PAIRS = 15, 3
"""Joints of a body, and of pairs among them, below which numbers and letters behind names show nothing."""


@dataclass(frozen=True)
class Name:
    """A joint's name, cut up. ``side`` is "left", "right" or ""; a helper's stem is empty."""

    side: str
    stem: str
    numbers: tuple[int, ...] = ()
    words: tuple[str, ...] = ()


@lru_cache(maxsize=64)
def read(names: tuple[str, ...]) -> tuple[Name, ...]:
    """Cut a skeleton's joint names up: ``mixamorig:LeftHandThumb2`` -> left, stem handthumb, number 2."""
    cuts = [words(_BRACKETED.sub("", strip_prefix(name))) for name in names]
    cuts = _without_shared_ends(_without_serial_numbers(cuts))
    sides = _SIDES | _letters_for_sides(cuts)
    return tuple(_name(name, cut, sides) for name, cut in zip(names, cuts, strict=True))


def _without_serial_numbers(cuts: list[list[str]]) -> list[list[str]]:
    """Cut names without the number that ends each, where nearly all joints of a body have one of their own
    (``Hips_01``, ``Spine_02``, ...)."""
    numbered = [len(cut) > 1 and cut[-1].isdigit() for cut in cuts]
    numbers = {cut[-1] for cut, has in zip(cuts, numbered, strict=True) if has}
    if len(cuts) < _BODY or len(numbers) < _NEARLY_ALL * len(cuts):
        return cuts
    return [cut[:-1] if has else cut for cut, has in zip(cuts, numbered, strict=True)]


def _letters_for_sides(cuts: list[list[str]]) -> dict[str, str]:
    """French ``g`` and ``d``, Spanish ``i`` and ``d``, English ``le`` and ``ri``, where names come in pairs
    that end with them."""
    for left, right in (("g", "d"), ("i", "d"), ("le", "ri")):
        bases = [{tuple(cut[:-1]) for cut in cuts if cut[-1:] == [letters]} for letters in (left, right)]
        if len(bases[0] & bases[1]) >= _PAIRS:
            return {left: "left", right: "right"}
    return {}


def _without_shared_ends(cuts: list[list[str]]) -> list[list[str]]:
    """Cut names without the words that nearly all of them begin or end with, words of the body excepted."""
    for end, rest in ((0, slice(1, None)), (-1, slice(-1))):
        while (word := _shared([cut[end] for cut in cuts if len(cut) > 1], len(cuts))) is not None:
            cuts = [cut[rest] if len(cut) > 1 and cut[end] == word else cut for cut in cuts]
    return cuts


def _shared(ends: Sequence[str], names: int) -> str | None:
    """The word among the ``ends`` of so many names that nearly all have; None: there is none."""
    word, count = max(Counter(ends).items(), key=lambda each: each[1], default=("", 0))
    return None if count < _NEARLY_ALL * names or word in _SIDES or _of_the_body(word) else word


def _of_the_body(stem: str) -> bool:
    """Whether a stem names a joint of the body, of whichever side."""
    return stem in LIMB_STEMS or stem in _TRUNK_STEMS or finger_of((stem,)) is not None


def _name(name: str, cut: Sequence[str], sides: Mapping[str, str]) -> Name:
    """The parts of a name, by its words and numbers. sides: word -> side."""
    if strip_prefix(name).startswith("__"):
        return Name("", "helper", words=("helper",))
    letters = [word for word in cut if not word.isdigit()]
    numbers = tuple(int(word) for word in cut if word.isdigit())
    ends = [*letters[:1], *letters[-1:], *(word for word in letters if word in ("left", "right", "l", "r"))]
    side = ""
    if len(letters) > 1 and (word := next((each for each in ends if each in sides), None)):
        side = sides[word]
        letters.remove(word)
    elif len(letters) == 1:
        side, letters[0] = _run_together(letters[0])
    plain = [word for word in letters if word not in _MODIFIERS | _MIDDLE] or letters
    ahead = sorted(plain, key=lambda word: word not in _FORE | _HIND)
    behind = plain[1:] if plain and plain[0] in LIMBS else plain
    stems = ["".join(each) for each in (plain, ahead, behind)]
    stem = next((each for each in stems if each in LIMB_STEMS), stems[0])
    if (
        plain
        and not _of_the_body(stem)
        and all(word in LIMB_STEMS or word in _TRUNK_STEMS for word in plain)
    ):
        stem = plain[-1]  # of ``head_M_neck`` and ``FootAnkle`` the nearer word
    return Name(side, stem, numbers, tuple(plain))


def _run_together(word: str) -> tuple[str, str]:
    """The side and the rest of a word such as ``lfemur`` or ``handleft``; no side for others."""
    for side in ("left", "right"):
        for rest in (word.removeprefix(side), word.removesuffix(side), word.removeprefix(side[0])):
            if rest != word and (
                rest in ("hipjoint", "fingers") or rest in LIMB_STEMS or finger_of((rest,))
            ):
                return side, rest
    return "", word


def words(text: str) -> list[str]:
    """Words and numbers of a name, in lower case: ``HorseRun_02`` -> horse, run, 02."""
    return [word.lower() for word in _WORD.findall(fold(text))]


def strip_prefix(name: str) -> str:
    """The name without name space and rig prefix: ``newVegas:Hips`` and ``CC_Base_Hips`` -> ``Hips``."""
    bare = _PREFIX.sub("", name.strip())
    return bare or name


def finger_of(words: Sequence[str]) -> str | None:
    """The finger that the words of a name speak of: hand, thumb -> thumb."""
    return FINGERS.get("".join(word for word in words if word not in _OF_FINGERS))
