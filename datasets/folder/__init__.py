"""Your own motion files: motions, and the bodies that shall perform them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Literal

import numpy as np

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard, Unreadable
from retarget_bench.api.datasets import usual_split
from retarget_bench.errors import BenchError, Unusable, some
from retarget_bench.files import digest
from retarget_bench.motion import importer, kinematics
from retarget_bench.motion.character import Character, Motion, resampled_frames
from retarget_bench.motion.files import format_of
from retarget_bench.motion.files.catalogue import by_name, existing, fingerprint
from retarget_bench.motion.files.formats import AMASS, BVH
from retarget_bench.motion.files.reading import Reading
from retarget_bench.plugins.code_hash import code_hash, package_code
from retarget_bench.training.lazy_clips import Cast, NamedClips, manifest

from .bodies import LAYOUTS, ROUNDING, Files, find

_CACHED = 64
"""So many motions a process keeps."""
Protocol = Literal["all", "split", "train"]
Part = Literal["test", "validation"]

TENTHS = ("test", "test", "validation", *["train"] * 7)
"""The part of each tenth of the names of clips with protocol=split."""
STILL = 1e-4
"""Share of a body's height within which something counts as not moving at all."""


class Folder(Dataset):
    """Every clip of every body is carried to every other body, or to ``target`` alone.

    A case has a reference where source and target are one body, or where both have a clip of that name and
    of the same length (``pairs=names``). Otherwise it has none, and only reference-free metrics apply.
    """

    card = DatasetCard(
        name="folder",
        summary="your own motion files, paired by name or not paired at all",
        version="1",
        licence="yours",
        obtain=f"give a folder of motion files, --root DIR: {LAYOUTS}",
        parameters={
            "root": f"{LAYOUTS}; loose files with the same joints and bones are one body",
            "target": "a file, or a folder with files of one body: the only body to retarget to",
            "pairs": "names (clips of the same name and length are each other's reference) or none",
            "fps": "frames per second of the cases; 0 keeps each file's own",
            "rate": "frames per second that the files truly have; 0 takes what each says",
            "unit": "unit of the files (m, cm, ...), or auto",
            "up": "up axis of the files, or auto",
            "protocol": (
                "all (every clip is a case and none is trained on), split (by the clips' names: about a "
                "fifth is tested, a tenth validates, the rest is trained on) or train (all are trained on)"
            ),
            "part": "of protocol=split: test, or validation",
            "inner_positions": (
                "drop, bake (into rotations) what joints below the root do that bones of constant length "
                "cannot; auto drops it"
            ),
            "body_model": "of AMASS files: an SMPL body model, or a folder of them (one folder per person)",
            "roles": 'a TOML file of "joint" = "role" for joints that are not recognised',
        },
        locations=("root", "target", "body_model"),
    )

    def __init__(
        self,
        root: str = "",
        target: str = "",
        pairs: Literal["names", "none"] = "names",
        fps: float = 30.0,
        unit: str = "auto",
        up: str = "auto",
        roles: str = "",
        protocol: Protocol = "all",
        part: Part = "test",
        inner_positions: Literal["auto", "drop", "bake"] = "auto",
        rate: float = 0.0,
        body_model: str = "",
    ) -> None:
        if rate and not 0.0 < rate <= 1e5:
            raise BenchError(f"folder: rate={rate:g} is not a frame rate (0 takes what each file says)")
        if fps and not 1.0 <= fps <= 1000.0:
            raise BenchError(f"folder: fps={fps:g} is not a frame rate (0 keeps each file's own)")
        self._root, self._target, self._pairs, self._fps = root, target, pairs, fps
        self._unit, self._up, self._roles = unit, up, roles
        if part != "test" and protocol != "split":
            raise BenchError("folder: part=validation means something with protocol=split alone")
        self._protocol, self._part = protocol, part
        self._inner, self._rate, self._body_model = inner_positions, rate, body_model
        self._dropped: dict[str, str] = {}
        self._read = lru_cache(maxsize=_CACHED)(self._import)
        self._character = lru_cache(maxsize=None)(self._model)

    # ------------------------------------------------------------------------------- the contract
    @property
    def content(self) -> str:
        """A hash of the files' bytes and of how they are read."""
        files = fingerprint(by_name(self._files.bodies, self._files.entries))
        overrides = self._reading.overrides
        roles = digest(repr(sorted(overrides.items()))) if overrides else "found"
        protocol = "" if self._protocol == "all" else f", protocol {self._protocol}, {self._part}"
        how = f"{self._fps:g} fps, unit {self._unit}, up {self._up}, roles {roles}, {self._pairs}"
        how += f", rate {self._rate:g}" if self._rate else ""
        how += ", baked" if self._inner == "bake" else ""
        how += f", bodies {self._shapes}" if self._body_model else ""
        if any(format_of(path) is not BVH for own in self._files.bodies.values() for path in own.values()):
            # BVH's reader counts as code of every method
            how += f", readers {code_hash(package_code('motion.files'))}"
        return f"{files} ({how}{protocol})"

    @property
    def _shapes(self) -> str:
        """A hash of all bodies' bones, which a body model decides."""
        bones = {name: np.round(body.skeleton.offsets, 6) + 0.0 for name, body in self._models[0].items()}
        return digest(repr(sorted((name, each.tolist()) for name, each in bones.items())), 16)

    @property
    def label(self) -> str:
        aim = f" to {self._files.targets[0]}" if self._target else ""
        protocol = "" if self._protocol == "all" else f", {self._protocol}"
        part = ", validation" if self._part == "validation" else ""
        root = Path(self._root).expanduser()
        root = root if root.name.strip(".") else root.resolve()
        return f"folder {root.name}{aim}{protocol}{part}"

    @cached_property
    def notes(self) -> Sequence[str]:
        notes = list(self._unread)
        for body, folders in self._files.joined.items():
            notes.append(f"{body} is one body in {len(folders)} folders: {some(folders, 5)}")
        if self._protocol == "train":
            notes.insert(0, "every clip is trained on (protocol=train), and none is a case")
        elif not self._any(self._part):
            notes.insert(0, f"protocol=split keeps none of {self._count} for {self._part}")
        paired = sum(self._paired(info.source, info.target, info.clip) for info in self._infos)
        if paired < len(self._infos):
            without = len(self._infos) - paired
            notes.append(
                f"{without} of {len(self._infos)} cases have no reference: reference-free metrics only"
            )
        if self._unequal:
            notes.append(f"clips of the same name but of unequal length: {some(self._unequal, 5)}")
        return tuple(notes)

    @cached_property
    def unreadable(self) -> Unreadable | None:
        """The files that cannot be read, by their place below the root."""
        root = Path(self._root).expanduser()
        entries = self._files.entries
        problems = {
            (path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)): entry.problem
            for path, entry in entries.items()
            if entry.problem
        }
        return Unreadable(len(entries), problems) if problems else None

    @cached_property
    def _unread(self) -> Sequence[str]:
        """Notes on files and bodies that no case uses."""
        notes = []
        if self.unreadable is not None:
            notes.append(self.unreadable.sentence)
        if problems := self._models[1]:
            unusable = [f"{body} ({problem})" for body, problem in problems.items()]
            notes.append(
                f"{len(unusable)} bod{'y' if len(unusable) == 1 else 'ies'} cannot be used: "
                f"{some(unusable, 5)}"
            )
        dropped = [f"{body}, {words}" for body, words in sorted(self._dropped.items())]
        notes += [f"{words} (inner_positions=bake fits rotations to that)" for words in dropped]
        return tuple(notes)

    def characters(self) -> Mapping[str, Character]:
        """Those of the cases and, unless every clip is a case, those that are trained on."""
        names = {name for info in self._infos for name in (info.source, info.target)}
        names |= {name for bodies in self.training().values() for name in bodies}
        return {name: self._character(name) for name in sorted(names)}

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        return tuple(info for info in self._infos if (info.task, info.split) == (task, split))

    def load(self, info: CaseInfo) -> Case:
        """Raises FileError where a file cannot be read, SkeletonError where a body cannot be used."""
        source = self.motion(info.source, info.clip)
        if not self._paired(info.source, info.target, info.clip):
            return Case(info, source, self._character(info.target))
        reference = self.motion(info.target, info.clip)
        return Case(info, source, reference.character, reference)

    def motion(self, body: str, clip: str) -> Motion:
        """The motion of a body in a clip, as its own character where the file has that body exactly."""
        path = self._files.bodies.get(body, {}).get(clip)
        if path is None:
            raise BenchError(f"{self._root} holds no clip {clip!r} of {body!r}")
        return self._read(body, path)

    # ------------------------------------------------------------------------------- to train on
    def training(self) -> Cast:
        """Structure -> body -> those of its clips that the protocol keeps for training."""
        cast: dict[str, dict[str, NamedClips]] = {}
        if self._protocol != "all":
            for body in filter(self._models[0].__contains__, self._files.sources):
                if names := self._clips(body, "train"):
                    clips = NamedClips(names, partial(self._trained, body))
                    cast.setdefault(self._character(body).structure, {})[body] = clips
        return cast

    def _trained(self, body: str, clip: str) -> Motion:
        """Raises Unusable where the file holds no motion of a whole body."""
        motion = self.motion(body, clip)
        if why := unusable(motion):
            raise Unusable(clip, why)
        return motion

    @property
    def training_notes(self) -> Sequence[str]:
        """Clips that are not trained on, with the reason."""
        if self._protocol == "all":
            return ("every clip is a case: protocol=split keeps some to train on, and protocol=train all",)
        if self._any("train"):
            return self._unread
        few = f"protocol=split keeps none of {self._count} to train on: protocol=train trains on all"
        return (few, *self._unread)

    def validation(self) -> Folder | None:
        """The clips that protocol=split keeps to steer by; None where there are none."""
        if not self._any("validation"):
            return None
        same = (self._root, self._target, self._pairs, self._fps, self._unit, self._up, self._roles)
        return Folder(*same, self._protocol, "validation", self._inner, self._rate, self._body_model)

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """Bodies, structures and clips that training and its validation have: what weights carry."""
        aside = [clip for body in self._files.sources for clip in self._clips(body, "validation")]
        return manifest(self.training(), aside)

    def _clips(self, body: str, part: str) -> tuple[str, ...]:
        """Those of a body's clips that are of a part."""
        return tuple(clip for clip in self._files.sources[body] if part_of(clip, self._protocol) == part)

    def _any(self, part: str) -> bool:
        return any(self._clips(body, part) for body in self._files.sources)

    @property
    def _count(self) -> str:
        clips = len({clip for own in self._files.sources.values() for clip in own})
        return f"{clips} clip{'s' * (clips > 1)}"

    # ------------------------------------------------------------------------------- what there is
    @cached_property
    def _files(self) -> Files:
        return find(self._root, self._target, self._rate or None)

    @cached_property
    def _infos(self) -> tuple[CaseInfo, ...]:
        infos = []
        usable = self._models[0]
        for source in filter(usable.__contains__, self._files.sources):
            for clip in self._clips(source, self._part):
                path = self._files.sources[source][clip]
                for target in filter(usable.__contains__, self._files.targets):
                    case = f"{self.card.name}/{source}>{target}/{clip}"
                    alike = usable[source].structure == usable[target].structure
                    split = usual_split(source == target, alike)
                    infos.append(
                        CaseInfo(case, "retarget", split, source, target, clip, frames=self._frames(path))
                    )
        return tuple(sorted(infos, key=lambda info: (info.clip, info.source, info.target)))

    @cached_property
    def _unequal(self) -> list[str]:
        """Clips that would be pairs but for their lengths."""
        if self._pairs == "none":
            return []
        infos = (info for info in self._infos if info.clip in self._files.bodies[info.target])
        return sorted({x.clip for x in infos if not self._paired(x.source, x.target, x.clip)})

    # ------------------------------------------------------------------------------- one at a time
    def _paired(self, source: str, target: str, clip: str) -> bool:
        """True where the target's clip of that name is the reference."""
        if source == target:
            return True
        target_clip = self._files.bodies[target].get(clip)
        if self._pairs == "none" or target_clip is None:
            return False
        source_clip = self._files.bodies[source][clip]
        rates = self._fps_of(source_clip), self._fps_of(target_clip)
        same_rate = bool(self._fps) or abs(rates[0] - rates[1]) < 1e-3 * rates[0]
        return same_rate and self._frames(source_clip) == self._frames(target_clip)

    def _frames(self, path: Path) -> int:
        frames = self._files.entries[path].frames
        return resampled_frames(frames, self._fps_of(path), self._fps) if self._fps else frames

    def _fps_of(self, path: Path) -> float:
        return self._rate or self._files.entries[path].fps

    @cached_property
    def _models(self) -> tuple[dict[str, Character], dict[str, str]]:
        """Every body that can be used, and why others cannot."""
        models, problems = {}, {}
        for body in self._files.bodies:
            try:
                models[body] = self._character(body)
            except BenchError as error:
                problems[body] = str(error)
        if not set(models) & set(self._files.sources) or not set(models) & set(self._files.targets):
            unusable = [f"{body} ({problem})" for body, problem in problems.items()]
            raise BenchError(
                f"no body of {self._root} and {self._target or 'itself'} can be used: {some(unusable)}"
            )
        return models, problems

    def _model(self, body: str) -> Character:
        """The body as its first clip has it; what that drops of the motion is kept for the notes."""
        path = next(iter(self._files.bodies[body].values()))
        imported = self._fresh(body, path)
        if imported.findings.dropped:
            self._dropped[body] = f"{path.name}: {imported.findings.dropped}"
        return imported.motion.character

    def _import(self, body: str, path: Path) -> Motion:
        motion = self._fresh(body, path).motion
        character = self._character(body)
        if not motion.skeleton.same_as(character.skeleton, tolerance=ROUNDING * character.height):
            return motion
        return character.motion(motion.rotations, motion.root, motion.fps)

    def _fresh(self, body: str, path: Path) -> importer.Imported:
        reading = self._reading
        if format_of(path) is not AMASS:
            reading = replace(reading, body_model=None)
        return importer.load(path, reading, name=body, fps=self._fps or None)

    @cached_property
    def _reading(self) -> Reading:
        """The reading of all files."""
        return Reading(
            unit=self._unit,
            up=self._up,
            roles=existing(Path(self._roles).expanduser()) if self._roles else None,
            inner_positions=self._inner,
            rate=self._rate or None,
            body_model=self._body_model or None,
        )


def part_of(clip: str, protocol: Protocol) -> str:
    """``test``, ``validation`` or ``train``: by the clip's name alone, so that clips of one name stay
    together and others stay where they are when files are added."""
    if protocol == "split":
        return TENTHS[int(digest(clip), 16) % len(TENTHS)]
    return "test" if protocol == "all" else "train"


def unusable(motion: Motion) -> str:
    """The sign that a file lost its motion, or a part of it; "" where there is none.

    Hips that keep their height to a ten-thousandth of the body's while limbs move are no motion of
    anybody: some converters drop the vertical path of the root.
    """
    positions, _ = kinematics.forward(motion.skeleton, motion.rotations, motion.root)  # not to be kept
    within = STILL * motion.character.height
    if np.ptp(positions, axis=0).max(initial=0.0) <= within:
        return "nothing moves in it"
    hips = positions[:, motion.character.joint_of.get("hips", 0)]
    if np.ptp(hips[:, 1]) <= within:
        return "its hips never change their height"
    return ""


plugin = Folder
