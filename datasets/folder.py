"""Your own BVH files: motions, and the bodies that shall perform them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Literal

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.catalogue import Entry, bvh_files, catalogue, contents, fingerprint, some, subfolders
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import digest
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, resampled_frames
from retarget_bench.motion.roles import load_overrides

LAYOUTS = "DIR/clip.bvh, or DIR/Body/clip.bvh with one folder per body"
_KEPT = 64
"""So many motions a process keeps."""
Bodies = dict[str, dict[str, Path]]
"""Body name -> clip name -> file."""


class Folder:
    """Every clip of every body is carried to every other body, or to ``target`` alone.

    A case has a reference where source and target are one body, or where both have a clip of that name and
    of the same length (``pairs=names``). Otherwise it has none, and only reference-free metrics apply.
    """

    card = DatasetCard(
        name="folder",
        summary="your own BVH files, paired by name or not paired at all",
        version="1",
        licence="yours",
        obtain=f"give a folder of BVH files, --root DIR: {LAYOUTS}",
        parameters={
            "root": f"{LAYOUTS}; loose files with the same hierarchy are one body",
            "target": "a BVH file, or a folder with files of one body: the only body to retarget to",
            "pairs": "names (clips of the same name and length are each other's reference) or none",
            "fps": "frames per second of the cases; 0 keeps each file's own",
            "unit": "unit of the files (m, cm, ...), or auto",
            "up": "up axis of the files, or auto",
            "roles": 'a TOML file of "joint" = "role" for joints that are not recognised',
        },
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
    ) -> None:
        if fps and not 1.0 <= fps <= 1000.0:
            raise BenchError(f"folder: fps={fps:g} is not a frame rate (0 keeps each file's own)")
        self._root, self._target, self._pairs, self._fps = root, target, pairs, fps
        self._unit, self._up, self._roles = unit, up, roles
        self._read = lru_cache(maxsize=_KEPT)(self._import)

    # ------------------------------------------------------------------------------- the contract
    @property
    def content(self) -> str:
        """A hash of the files' bytes and of how they are read."""
        named = {f"{name}/{clip}": path for name, own in self._bodies.items() for clip, path in own.items()}
        files = fingerprint({name: self._entries[path] for name, path in named.items()})
        roles = digest(repr(sorted(self._overrides.items()))) if self._overrides else "found"
        return (
            f"{files} ({self._fps:g} fps, unit {self._unit}, up {self._up}, roles {roles}, {self._pairs})"
        )

    @property
    def label(self) -> str:
        return f"folder {Path(self._root).name}" + (f" to {self._targets[0]}" if self._target else "")

    @cached_property
    def notes(self) -> Sequence[str]:
        found = []
        broken = {path: entry.problem for path, entry in self._entries.items() if entry.problem}
        if broken:
            named = [f"{path.name} ({problem})" for path, problem in broken.items()]
            found.append(f"{len(named)} of {len(self._entries)} files cannot be read: {some(named, 5)}")
        if problems := self._models[1]:
            told = [f"{body} ({problem})" for body, problem in problems.items()]
            found.append(f"{len(told)} bodies cannot be used: {some(told, 5)}")
        paired = sum(self._paired(info.source, info.target, info.clip) for info in self._infos)
        if paired < len(self._infos):
            without = len(self._infos) - paired
            found.append(
                f"{without} of {len(self._infos)} cases have no reference: reference-free metrics only"
            )
        if self._unequal:
            found.append(f"clips of the same name but of unequal length: {some(self._unequal, 5)}")
        return tuple(found)

    def characters(self) -> Mapping[str, Character]:
        names = {name for info in self._infos for name in (info.source, info.target)}
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
        """What a body does in a clip, as its own character where the file has that body exactly."""
        path = self._bodies.get(body, {}).get(clip)
        if path is None:
            raise BenchError(f"{self._root} holds no clip {clip!r} of {body!r}")
        return self._read(body, path)

    # ------------------------------------------------------------------------------- what there is
    @cached_property
    def _given(self) -> tuple[dict[str, Path], Bodies, dict[str, Path]]:
        """Loose files, files by folder, files of the target."""
        if not self._root:
            raise BenchError(f"folder needs your files: give --root DIR, or folder[root=DIR]; {LAYOUTS}")
        root = _existing(self._root, "root")
        if root.is_file():
            loose, inside = {root.stem: root}, {}
        else:
            loose = bvh_files(root)
            inside = {each.name: found for each in subfolders(root) if (found := bvh_files(each))}
            if not loose and not inside:
                raise BenchError(f"{root} holds no BVH files ({LAYOUTS}); it holds {contents(root)}")
        aim: dict[str, Path] = {}
        if self._target:
            target = _existing(self._target, "target")
            aim = {target.stem: target} if target.is_file() else bvh_files(target)
            if not aim:
                raise BenchError(f"target {target} holds no BVH files; it holds {contents(target)}")
        return loose, inside, aim

    @cached_property
    def _entries(self) -> dict[Path, Entry]:
        loose, inside, aim = self._given
        within = [path for clips in inside.values() for path in clips.values()]
        files = dict.fromkeys([*loose.values(), *within, *aim.values()])
        return catalogue(Path(self._root), files)

    @cached_property
    def _sources(self) -> Bodies:
        """The bodies of ``root`` with their readable clips."""
        loose, inside, _ = self._given
        bodies = {name: self._readable(clips) for name, clips in inside.items()}
        by_hierarchy: dict[str, str] = {}
        for clip, path in self._readable(loose).items():
            name = by_hierarchy.setdefault(self._entries[path].hierarchy, _free(clip, bodies))
            bodies.setdefault(name, {})[clip] = path
        bodies = {name: clips for name, clips in sorted(bodies.items()) if clips}
        if not bodies:
            problems = [f"{path.name} ({entry.problem})" for path, entry in self._entries.items()]
            raise BenchError(f"none of the files of {self._root} can be read: {some(problems, 5)}")
        return bodies

    @cached_property
    def _targets(self) -> tuple[str, ...]:
        """The bodies to retarget to: all, or the one that ``target`` names."""
        aim = self._given[2]
        if not self._target:
            return tuple(self._sources)
        clips = self._readable(aim)
        if not clips:
            raise FileError(self._target, "; ".join(self._entries[path].problem for path in aim.values()))
        files = {path.resolve() for path in clips.values()}
        for name, own in self._sources.items():
            if files <= {path.resolve() for path in own.values()}:
                return (name,)
        return (_free(Path(self._target).stem, self._sources),)

    @cached_property
    def _bodies(self) -> Bodies:
        """Every body: those of ``root``, and the target where it lies elsewhere."""
        return {name: self._readable(self._given[2]) for name in self._targets} | self._sources

    @cached_property
    def _infos(self) -> tuple[CaseInfo, ...]:
        infos = []
        usable = self._models[0]
        for source in filter(usable.__contains__, self._sources):
            for clip, path in self._sources[source].items():
                for target in filter(usable.__contains__, self._targets):
                    case = f"{self.card.name}/{source}>{target}/{clip}"
                    split = self._split(source, target)
                    infos.append(
                        CaseInfo(case, "retarget", split, source, target, clip, frames=self._frames(path))
                    )
        return tuple(sorted(infos, key=lambda info: (info.clip, info.source, info.target)))

    @cached_property
    def _unequal(self) -> list[str]:
        """Clips that would be pairs but for their lengths."""
        if self._pairs == "none":
            return []
        return sorted(
            {
                info.clip
                for info in self._infos
                if info.clip in self._bodies[info.target]
                and not self._paired(info.source, info.target, info.clip)
            }
        )

    # ------------------------------------------------------------------------------- one at a time
    def _split(self, source: str, target: str) -> str:
        if source == target:
            return "self"
        same = self._character(source).structure == self._character(target).structure
        return "intra" if same else "cross"

    def _paired(self, source: str, target: str, clip: str) -> bool:
        """Whether the target's clip of that name is the reference."""
        if source == target:
            return True
        theirs = self._bodies[target].get(clip)
        if self._pairs == "none" or theirs is None:
            return False
        mine = self._bodies[source][clip]
        rates = self._entries[mine].fps, self._entries[theirs].fps
        same_rate = bool(self._fps) or abs(rates[0] - rates[1]) < 1e-3 * rates[0]
        return same_rate and self._frames(mine) == self._frames(theirs)

    def _frames(self, path: Path) -> int:
        entry = self._entries[path]
        return resampled_frames(entry.frames, entry.fps, self._fps) if self._fps else entry.frames

    def _readable(self, files: Mapping[str, Path]) -> dict[str, Path]:
        return {clip: path for clip, path in files.items() if not self._entries[path].problem}

    def _character(self, body: str) -> Character:
        return self._models[0][body]

    @cached_property
    def _models(self) -> tuple[dict[str, Character], dict[str, str]]:
        """Every body as its first clip has it, and why others cannot be used."""
        models, problems = {}, {}
        for body, clips in self._bodies.items():
            try:
                models[body] = self._fresh(body, next(iter(clips.values()))).character
            except BenchError as error:
                problems[body] = str(error)
        if not set(models) & set(self._sources) or not set(models) & set(self._targets):
            told = [f"{body} ({problem})" for body, problem in problems.items()]
            raise BenchError(
                f"no body of {self._root} and {self._target or 'itself'} can be used: {some(told)}"
            )
        return models, problems

    def _import(self, body: str, path: Path) -> Motion:
        motion = self._fresh(body, path)
        character = self._character(body)
        if not motion.skeleton.same_as(character.skeleton):
            return motion
        return character.motion(motion.rotations, motion.root, motion.fps)

    def _fresh(self, body: str, path: Path) -> Motion:
        return importer.load(
            path,
            unit=self._unit,
            up=self._up,
            roles=self._overrides,
            fps=self._fps or None,
            name=body,
        ).motion

    @cached_property
    def _overrides(self) -> Mapping[str, str | None] | None:
        return load_overrides(_existing(self._roles, "roles")) if self._roles else None


def _existing(given: str, what: str) -> Path:
    path = Path(given).expanduser()
    if path.exists():
        return path
    nearest = next((each for each in path.parents if each.is_dir()), Path())
    raise BenchError(f"{what}: there is no {path}; {nearest} exists and holds {contents(nearest)}")


def _free(name: str, taken: Mapping[str, object]) -> str:
    """``name``, or ``name-2`` and so on where that is taken."""
    return next(
        each for each in (name, *(f"{name}-{n}" for n in range(2, len(taken) + 3))) if each not in taken
    )


plugin = Folder
