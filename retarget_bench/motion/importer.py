"""Any motion file to a motion in metres, Y up: roles, unit and up axis are inferred, and every guess is
listed.

``load`` never asks: what the file does not say is decided from the body and its motion, listed in
``Imported.findings``, and can be said better by a ``Reading``.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from retarget_bench.motion import (
    files,
    kinematics,
    plausibility,
    role_checks,
    role_structure,
    rotation,
    species,
    up_axis,
)
from retarget_bench.motion import inner_positions as inner
from retarget_bench.motion.body import FORWARD, LEFT, UP, PosedBody
from retarget_bench.motion.character import Character, Motion, Positions
from retarget_bench.motion.files import format_of
from retarget_bench.motion.files.reading import UNITS, Reading
from retarget_bench.motion.findings import Findings
from retarget_bench.motion.fitting.recorded import with_rotations
from retarget_bench.motion.measures import measure
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.recording import MIRROR, Recording, mirrored
from retarget_bench.motion.reference_pose import BONE_TOLERANCE
from retarget_bench.motion.role_finding import find as find_roles
from retarget_bench.motion.roles import (
    ESSENTIAL,
    explain,
    has_level_trunk,
    is_quadruped,
)
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.up_axis import SAMPLE, UP_AXES, Axis

_UNIT_PENALTY = {"m": 0.0, "cm": 0.0, "mm": 0.3, "dm": 0.5, "cmu": 0.7, "inch": 1.1}
"""Added to the logarithm of a size ratio: rarer units have to explain a body so much better."""
_PRESCRIBED = 2.0
"""Likewise, added for other units than the one that the file's format prescribes."""
_OF_PEOPLE = 2.0
"""Likewise, added for other units than metres, centimetres and millimetres in files of animals."""
_TALL = 1.6
"""Metres of role height that are typical of people."""

_AT_FLOOR, _OFTEN = 0.03, 0.1
"""Body heights from y = 0 within which feet are on it, and the share of the time from which they are there
often enough for steps, ledges and lower floors to explain the rest."""
_ON_ITS_SIDE = math.sin(math.radians(60.0))
"""How upright the line between the sides is of a body that lies on one of them."""
_GUESSED = (
    "names do not say what joints are: {} roles are a guess by the tree and the places of joints ({}): "
    "look at them (bench doctor --sheet) and correct what is wrong (bench doctor --save)"
)


@dataclass(frozen=True, eq=False)
class Imported:
    """A file's motion and how it was understood.

    reading: what was said of it.
    places:  ``(frames, joints, 3)`` metres, every joint in its parent's frame, where joints below the root
             move there and these positions are kept (``inner_positions.py``).
    """

    motion: Motion
    findings: Findings
    reading: Reading = Reading()
    places: np.ndarray | None = None

    @property
    def settled(self) -> Reading:
        """The reading with all findings filled in: with it a file is read alike, whatever is guessed."""
        findings = self.findings
        body = self.motion.character
        return replace(
            self.reading,
            unit=findings.unit[0],
            up=findings.up,
            rate=findings.fps if findings.fps_stated is None else self.reading.rate,
            roles=dict(zip(body.skeleton.names, body.roles, strict=True)),
        )


def load(
    path: str | Path,
    reading: Reading = Reading(),
    *,
    name: str | None = None,
    fps: float | None = None,
) -> Imported:
    """Read a motion file of any format (``motion.files``) as a motion in metres, Y up, facing as recorded.

    name: of the character; the file's name by default.
    fps:  resample to this rate.
    Where a file states joint positions alone, rotations are fitted to them, and a note says how well.
    Raises FileError for files that cannot be read, NotSupported for what their format leaves no choice in,
    SkeletonError for roles that do not fit.
    """
    path, reading = files.with_take(path, reading)
    return understood(path, format_of(path).read(path, reading), reading, name, fps)


def understood(
    path: Path, stated: Recording, reading: Reading, name: str | None = None, fps: float | None = None
) -> Imported:
    """``load`` of what was read already, as the file has it."""
    recording = with_rotations(stated if reading.rate is None else replace(stated, fps=reading.rate))
    if reading.mirror:
        recording = mirrored(recording)
    named, roles, confidence = _roles(recording, reading.overrides)
    axis = up_axis.axis(recording, roles, reading.up)
    upright = up_axis.upright(recording, axis.up)
    sample = upright.rotations[:: 1 + (len(upright.rotations) - 1) // SAMPLE]
    guessed = tuple(role for role, said in zip(roles, named, strict=True) if role and role != said)
    body = Character.of(name or path.stem, upright.skeleton, roles=roles, sample=sample)
    body = replace(body, guessed=guessed)
    size = _size(path, body, recording, reading)
    places = None if recording.places is None else recording.places * size.unit[1]
    settled = inner.settled(_scaled(body, upright, size.unit[1]), places, reading.inner_positions)
    motion, places = settled.motion, settled.places
    if guessed:
        doubt = _GUESSED.format(len(guessed), confidence)
        recording = replace(recording, doubts=(*recording.doubts, doubt))
    findings = _findings(path, stated, recording, axis, size, settled, reading.rate is not None)
    sides = role_checks.doubt(motion, _changed(recording, reading.overrides), mirrored=reading.mirror)
    more = (*filter(None, [sides]), *plausibility.doubts(motion))
    findings = replace(findings, mirrored=reading.mirror, doubts=(*findings.doubts, *more))
    if fps is not None:
        if places is not None:
            places = Positions(motion.character, places, motion.fps).resample(fps).positions
        motion = motion.resample(fps)
    return Imported(motion, findings, reading, places)


def _roles(
    recording: Recording, explicit: Mapping[str, str | None]
) -> tuple[Sequence[str | None], Sequence[str | None], str]:
    """Roles as the user, the file and names have them; with a guess of those that are missing; and how
    clear that guess is."""
    stated = {name: role for name, role in recording.roles.items() if role not in explicit.values()}
    named = find_roles(recording.skeleton, {**stated, **explicit})
    return named, *role_structure.completed(recording.skeleton, named, _places(recording), explicit)


def _changed(recording: Recording, explicit: Mapping[str, str | None]) -> dict[str, str | None]:
    """Joint name -> role, of those that the user set otherwise than they are inferred: a table that was
    proposed is not doubted when it comes back."""
    if not explicit:
        return {}
    inferred = dict(zip(recording.skeleton.names, _roles(recording, {})[1], strict=True))
    return {name: role for name, role in explicit.items() if inferred[name] != role}


def _places(recording: Recording) -> np.ndarray:
    """``(frames, joints, 3)`` of a sample of a recording, in its unit and axes."""
    sample = slice(None, None, 1 + (len(recording.rotations) - 1) // SAMPLE)
    rotations, root = recording.rotations[sample], recording.root[sample]
    return kinematics.forward(recording.skeleton, rotations, root)[0]


def _findings(
    path: Path,
    stated: Recording,
    recording: Recording,
    axis: Axis,
    size: "_Size",
    settled: inner.Settled,
    rate_explicit: bool,
) -> Findings:
    """All findings. stated: as the file has it; recording: at the true rate; rate_explicit: the
    user set it."""
    motion = settled.motion
    lowest = _lowest(motion)
    joints, roles = motion.skeleton, motion.character.roles
    moves = np.any(motion.rotations != motion.rotations[:1]) or np.any(motion.root != motion.root[:1])
    lengths = zip(joints.names[1:], joints.bone_lengths[1:], strict=True)
    return Findings(
        path=path,
        unit=size.unit,
        unit_explicit=size.explicit,
        other_unit=size.other,
        unit_prescribed=not size.explicit and size.unit[0] == recording.unit,
        up=axis.up,
        up_sure=axis.sure,
        up_explicit=axis.explicit,
        up_prescribed=not axis.explicit and recording.up != "",
        notes=(*recording.notes, *settled.notes),
        doubts=(*recording.doubts, *axis.doubts, *settled.doubts, *role_checks.left_out(motion)),
        dropped=settled.dropped,
        joints=tuple(zip(joints.names, explain(joints, roles), strict=True)),
        missing=tuple(role for role in ESSENTIAL if role not in roles),
        quadruped=is_quadruped(joints, roles),
        level=size.level,
        animal=size.animal,
        height=motion.character.height,
        stands=motion.character.measures.h4,
        rest_pose=rest_pose(joints, roles),
        facing=_facing(motion),
        fps=motion.fps,
        fps_stated=stated.fps if stated.rate_stated else None,
        rate_explicit=rate_explicit,
        frames=motion.frames,
        floor=float(np.median(lowest)),
        grounded=bool(np.mean(np.abs(lowest) < _AT_FLOOR * motion.character.height) > _OFTEN),
        zero_bones=tuple(joint for joint, length in lengths if length < 1e-9),
        still=not moves,
    )


def as_stated(motion: Motion, like: Imported) -> Motion:
    """A motion in the unit, with the up axis and the handedness of the file of its body."""
    back = rotation.conjugate(rotation.from_rotation_vector(np.array(UP_AXES[like.findings.up])))
    rotations = np.array(motion.rotations)
    rotations[:, 0] = rotation.multiply(back[None], rotations[:, 0])
    root = rotation.rotate(back[None], motion.root) / like.findings.unit[1]
    if like.reading.mirror:
        rotations, root = rotation.mirrored(rotations), root * MIRROR
    return replace(motion, rotations=rotations, root=root)


def places_as_stated(places: np.ndarray, like: Imported) -> np.ndarray:
    """``(frames, joints, 3)`` every joint in its parent's frame, likewise."""
    return places / like.findings.unit[1] * (MIRROR if like.reading.mirror else 1.0)


# ------------------------------------------------------------------------------------------------ unit
@dataclass(frozen=True)
class _Size:
    """The unit of a file, its name and metres; the next best guess with the body's metres; whether the body
    has a level trunk, and which animal the file's name says it is."""

    unit: tuple[str, float]
    explicit: bool
    other: tuple[str, float] | None
    level: bool
    animal: str


def _size(path: Path, body: Character, recording: Recording, reading: Reading) -> _Size:
    level = has_level_trunk(body.skeleton, body.roles)
    animal = species.animal_of(path) if level else ""
    tall = body.measures.h4 if level else body.height
    guesses = _units(tall, partial(species.improbable, animal=animal) if level else None, recording.unit)
    metres = reading.metres
    unit = (guesses[0], UNITS[guesses[0]]) if metres is None else (str(reading.unit), metres)
    others = [(each, tall * UNITS[each]) for each in guesses if each != unit[0]]
    return _Size(unit, metres is not None, others[0] if others else None, level, animal)


def _units(height: float, improbable: Callable[[float], float] | None, prescribed: str) -> list[str]:
    """Units, best guess first: in which a body of this height (file units) has a plausible size.

    height:     role height of people, standing height of animals.
    improbable: of animals, how badly a height in metres suits them.
    prescribed: the unit of the format, "" where it has none. Files that break the rule of their format by
        much (bodies in centimetres in glTF) are found all the same.
    """
    if height <= 0:
        return [prescribed or "m"]
    cost = {
        unit: (improbable(height * metres) if improbable else abs(math.log(height * metres / _TALL)))
        + _UNIT_PENALTY[unit]
        + _OF_PEOPLE * (improbable is not None and unit not in ("m", "cm", "mm"))
        + _PRESCRIBED * (prescribed not in ("", unit))
        for unit, metres in UNITS.items()
    }
    return sorted(cost, key=cost.__getitem__)


def _scaled(body: Character, recording: Recording, scale: float) -> Motion:
    """The motion in metres; reference pose and roles do not depend on the unit."""
    skeleton = body.skeleton.scaled(scale)
    character = replace(
        body,
        skeleton=skeleton,
        measures=measure(skeleton, body.roles, body.reference_pose),
        skin=recording.skin and partial(_scaled_mesh, recording.skin, scale),
    )
    return character.motion(recording.rotations, recording.root * scale, recording.fps)


def _scaled_mesh(skin: Callable[[], Mesh], scale: float) -> Mesh:
    return skin().scaled(scale)


# -------------------------------------------------------------------------------------------- findings
def rest_pose(skeleton: Skeleton, roles: Sequence[str | None]) -> str:
    """The kind of rest pose, in words."""
    body = PosedBody(skeleton, roles)
    if body.frame is None:
        return "unknown: no legs (or arms) and trunk were found"
    if not body.rests_in_a_pose:
        along = (
            "bones along the axes of their joints" if body.along_axes else "no pose that a body could take"
        )
        return f"{along}; a sample of motion tells how they are twisted"
    turned = (
        "" if rotation.angle(body.frame, rotation.identity()) < 1e-6 else ", turned against Y up, facing +Z"
    )
    if body.level:
        return f"standing on {'four' if body.quadruped else 'two'} legs, the trunk level{turned}"
    pair = body.joints("left_arm", "left_hand")
    if len(pair) < 2:
        return f"standing{turned}"
    arm = rotation.rotate(body.frame, body.line(*pair))
    below = math.atan2(-float(arm @ UP), float(np.hypot(arm[0], arm[2])))
    kind = "arms down" if below > math.radians(65) else "A-pose" if below > BONE_TOLERANCE else "T-pose"
    return f"{kind}{turned}"


def _facing(motion: Motion) -> float | None:
    """Degrees from +Z towards +X in the first frame.

    A direction square to the line between the sides, level: where the front of the hips points does not
    tell it of a body that bends over, lies on its back, or pecks. It does of one that lies on its side.
    """
    character = motion.character
    if "hips" not in character.joint_of or PosedBody(character.skeleton, character.roles).frame is None:
        return None
    hips = character.joint_of["hips"]
    away = rotation.conjugate(character.reference_globals[hips])
    turned = rotation.multiply(motion.at(slice(0, 1)).global_rotations[0, hips], away)
    left = rotation.rotate(turned, LEFT)
    forward = np.cross(left, UP) if abs(left @ UP) < _ON_ITS_SIDE else rotation.rotate(turned, FORWARD)
    return math.degrees(math.atan2(float(forward[0]), float(forward[2])))


def _lowest(motion: Motion) -> np.ndarray:
    """``(frames,)`` metres: the lowest joint or tip of the feet above y = 0, in a sample of frames."""
    skeleton = motion.skeleton
    ends = ("_foot", "_toe", "_toe_end")
    feet = [joint for role, joint in motion.character.joint_of.items() if role.endswith(ends)]
    feet = feet or list(range(len(skeleton)))
    sample = motion.at(np.unique(np.linspace(0, motion.frames - 1, SAMPLE).astype(int)))
    lowest = sample.positions[:, feet, 1].min(axis=1)
    for site in (site for site in skeleton.end_sites if site.parent in feet):
        tip = rotation.rotate(sample.global_rotations[:, site.parent], np.array([site.offset]))
        lowest = np.minimum(lowest, sample.positions[:, site.parent, 1] + tip[:, 1])
    return np.asarray(lowest)
