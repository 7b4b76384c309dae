"""Damaged files of a binary format: every one has to be read, or refused in one sentence.

    python tests/motion/mutated_files.py FBX 50000
    python tests/motion/mutated_files.py glTF 50000 --files Fox.glb

Files are damaged by flipped bits, other bytes, numbers where lengths may stand, cut ends, and parts put
elsewhere; every other file, where none is given, by values, links and records that make no sense in a file
that is sound otherwise. They are read with their mesh, as every command reads them, in one process with
limits of memory and time, which is started anew when it ends or hangs. That process hands FBX files to
copies of itself, which end as the processes do that read such files otherwise.

Counted are files that were read, sentences, tracebacks, crashes, hangs and slow files. The exit code is 1
where there is anything but the first two; the files of these are kept in --keep.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.motion import importer
from retarget_bench.motion.files import FORMATS

MEMORY, HANGS, SLOW = 4 << 30, 30.0, 5.0
"""Bytes of a process; seconds after which it hangs, and after which a file is slow."""
READ, SENTENCE, TRACEBACK, CRASH, HANG = "read", "sentence", "traceback", "crash", "hang"
FINE = (READ, SENTENCE)
LONGEST_SENTENCE = 1000


# --------------------------------------------------------------------------------------------- damage
def mutated(data: bytes, random: np.random.Generator) -> bytes:
    """A damaged copy."""
    found = bytearray(data)
    for _ in range(random.integers(1, 3)):
        _KINDS[random.integers(0, len(_KINDS))](found, random)
    return bytes(found)


def _flip(data: bytearray, random: np.random.Generator) -> None:
    for place in random.integers(0, max(len(data), 1), random.integers(1, 5)):
        if place < len(data):
            data[place] ^= 1 << int(random.integers(0, 8))


def _bytes(data: bytearray, random: np.random.Generator) -> None:
    start, length = int(random.integers(0, len(data) + 1)), int(random.integers(1, 9))
    data[start : start + length] = random.bytes(len(data[start : start + length]))


def _number(data: bytearray, random: np.random.Generator) -> None:
    """A length, count or offset that is none."""
    odd = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, len(data), len(data) * 2)
    width = (1, 2, 4, 8)[random.integers(0, 4)]
    start = int(random.integers(0, max(len(data) - width, 1)))
    value = odd[random.integers(0, len(odd))] & ((1 << 8 * width) - 1)
    data[start : start + width] = value.to_bytes(width, "little")


def _nearly(data: bytearray, random: np.random.Generator) -> None:
    """A number of 32 bits that is off by a little."""
    start = int(random.integers(0, max(len(data) - 4, 1)))
    value = int.from_bytes(data[start : start + 4], "little") + int(random.integers(-3, 4))
    data[start : start + 4] = (value & 0xFFFFFFFF).to_bytes(4, "little")


def _cut(data: bytearray, random: np.random.Generator) -> None:
    del data[int(random.integers(0, len(data) + 1)) :]


def _splice(data: bytearray, random: np.random.Generator) -> None:
    """A part put in the place of another, of the same length or not."""
    start, at = (int(each) for each in random.integers(0, len(data) + 1, 2))
    length, kept = (int(each) for each in random.integers(0, 400, 2))
    data[at : at + (length if random.random() < 0.8 else kept)] = data[start : start + length]


_KINDS = (*(_flip, _bytes, _number, _nearly, _splice) * 3, _cut)


# -------------------------------------------------------------------------------------------- reading
def load(path: Path) -> None:
    """Read a file, with its mesh. Raises ValueError for what is not finite."""
    motion = importer.load(path).motion
    mesh = motion.character.mesh
    arrays = [motion.positions] if mesh is None else [motion.positions, mesh.vertices, mesh.weights]
    if not all(np.isfinite(each).all() for each in arrays):
        raise ValueError("what was read is not finite")


def outcome(path: Path, load: Callable[[Path], None] = load) -> tuple[str, str]:
    """What became of a file, and what was said."""
    try:
        load(path)
    except BenchError as error:
        said = str(error)
        fine = "\n" not in said and len(said) < LONGEST_SENTENCE and str(path) in said
        return (SENTENCE if fine else TRACEBACK), said
    except BaseException:
        return TRACEBACK, traceback.format_exc()
    return READ, ""


def answer(pipe: Connection, load: Callable[[Path], None]) -> None:
    """Read files by their paths, as long as there are any."""
    import warnings

    warnings.simplefilter("error")
    try:
        import fbx_fork

        from retarget_bench.motion.files.fbx import child, content
    except ImportError:  # without ufbx, or where processes cannot be copied
        pass
    else:
        child.limit(MEMORY, 1 << 30)
        content.process = fbx_fork.process
    pipe.send("ready")
    while True:
        path = pipe.recv()
        pipe.send(outcome(Path(path), load))


class Reader:
    """The process that reads, started anew where it ended."""

    def __init__(self, load: Callable[[Path], None] = load) -> None:
        self._load = load
        self._process: multiprocessing.process.BaseProcess | None = None

    def start(self) -> None:
        """Start the process where there is none, and wait until it can read."""
        if self._process is None:
            context = multiprocessing.get_context("spawn")
            self._pipe, other = context.Pipe()
            self._process = context.Process(target=answer, args=(other, self._load), daemon=True)
            self._process.start()
            other.close()
            self._pipe.recv()

    def read(self, path: Path) -> tuple[str, str]:
        """What became of a file."""
        self.start()
        self._pipe.send(str(path))
        try:
            if self._pipe.poll(HANGS):
                found: tuple[str, str] = self._pipe.recv()
                return found
            said = HANG, f"no answer in {HANGS:g} s"
        except (EOFError, OSError):
            self._process.join(HANGS)
            said = CRASH, f"exit code {self._process.exitcode}"
        self.close()
        return said

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None


# -------------------------------------------------------------------------------------------- counting
def seeds(name: str) -> Iterator[bytes]:
    """Sound files of a format, each of another kind."""
    random = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "seed"
        if name == "glTF":
            import gltf_files

            yield gltf_files.person(random, frames=4).save(place.with_suffix(".glb")).read_bytes()
            flat = gltf_files.person(random, frames=3, turned=False, how="STEP", skin=False)
            yield flat.save(place.with_suffix(".glb")).read_bytes()
        elif name == "FBX":
            import fbx_files

            for made, kind in (
                (fbx_files.person(random, frames=3), {"packed": False}),
                (fbx_files.person(random, frames=3), {"version": 7500}),
                (fbx_files.person(random, frames=3, skin=False), {"version": 7700, "packed": False}),
                (fbx_files.person(random, frames=3), {"ascii": True}),
            ):
                yield made.save(place.with_suffix(".fbx"), **kind).read_bytes()


def damage(name: str) -> Callable[[np.random.Generator], bytes] | None:
    """Makes files of a format that can be taken apart and make no sense; None for formats without any."""
    sound = np.random.default_rng(0)
    if name == "glTF":
        import gltf_files

        made = gltf_files.person(sound, frames=4)
        made.bytes()
        data = bytes(made.data)
        return lambda random: gltf_files.packed(gltf_files.damaged(made.content, random), data)
    if name == "FBX":
        import fbx_files

        nodes = fbx_files.person(sound, frames=3).nodes()
        return lambda random: fbx_files.binary(fbx_files.damaged(nodes, random), packed=False)
    return None


def count(
    name: str,
    number: int,
    seed: int = 0,
    files: list[Path] | None = None,
    keep: Path | None = None,
    told: bool = False,
) -> Counter[str]:
    """How many damaged files of a format had which outcome; slow ones are counted as such, too."""
    form = next(each for each in FORMATS if each.name.casefold() == name.casefold())
    sound = [*(path.read_bytes() for path in files or ())] or list(seeds(form.name))
    if not sound:
        raise SystemExit(f"there are no files of {form.name} to damage: give some with --files")
    found, reader, senseless = Counter[str](), Reader(), damage(form.name)
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"odd{form.suffixes[0]}"
        for each in range(number):
            random = np.random.default_rng([seed, each])
            if senseless and not files and each % 2:
                data = senseless(random)
            else:
                data = mutated(sound[each // 2 % len(sound)], random)
            path.write_bytes(data)
            reader.start()
            start = time.perf_counter()
            kind, said = reader.read(path)
            slow = time.perf_counter() - start > SLOW
            found[kind] += 1
            found["slow"] += slow
            if keep and (kind not in FINE or slow):
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{kind}-{seed}-{each}{path.suffix}").write_bytes(data)
            if told and kind not in FINE:
                print(f"{each}: {kind}: {said}", flush=True)
            if told and (each + 1) % 1000 == 0:
                rate = (each + 1) / (time.perf_counter() - begin)
                print(f"{each + 1} files, {rate:.0f} per second: {dict(found)}", flush=True)
    reader.close()
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("format", help=", ".join(form.name for form in FORMATS))
    parser.add_argument("number", type=int, help="how many files")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--files", type=Path, nargs="*", help="sound files to damage [default: made ones]")
    parser.add_argument("--keep", type=Path, help="folder for files that were neither read nor refused")
    asked = parser.parse_args()
    found = count(asked.format, asked.number, asked.seed, asked.files, asked.keep, told=True)
    print(", ".join(f"{kind}: {found[kind]}" for kind in (*FINE, TRACEBACK, CRASH, HANG, "slow")))
    return int(any(found[kind] for kind in found if kind not in FINE))


if __name__ == "__main__":
    sys.exit(main())
