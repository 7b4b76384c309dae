"""Writing clips (.mp4, .gif, .webp) and stills (.png), atomically."""

import importlib
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path

import numpy as np
from PIL import Image

from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import atomic
from retarget_bench.viewer.colours import CONTACT

CLIPS = (".mp4", ".gif", ".webp")
STILL = ".png"
ENDINGS = (*CLIPS, STILL)
QUALITY = 80
"""Of .webp, 0 to 100."""
BEGUN, SAMPLED, SWATCH = 30, 6, 8
"""First pictures of a .gif, those of them that give it its colours, and rows of pixels for contacts."""
MOST_BYTES = 2e9
KEPT = {".gif": 1, ".webp": 3}
"""Bytes of a pixel that are in memory until all pictures are there."""


def ending(path: Path) -> str:
    """``.mp4``, ``.gif``, ``.webp`` or ``.png``. Raises BenchError for a file of another kind, or a video
    where there is no ffmpeg."""
    kind = path.suffix.lower()
    if kind not in ENDINGS:
        raise BenchError(f"{path}: clips are {', '.join(CLIPS)} and stills {STILL}; end the name in one")
    if kind == ".mp4":
        ffmpeg()
    return kind


def ffmpeg() -> str:
    """The program that makes videos: imageio-ffmpeg's, else the one on the PATH. Raises BenchError."""
    if find_spec("imageio_ffmpeg") is not None:
        with suppress(RuntimeError):  # a wheel without the program
            return str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
    if (program := shutil.which("ffmpeg")) is None:
        raise BenchError(
            "videos need ffmpeg, and there is none: pip install 'retarget-bench[video]', put ffmpeg on the "
            "PATH, or write a .gif or .webp"
        )
    return program


def check_length(path: Path, size: tuple[int, int], count: int) -> None:
    """Raises BenchError where so many pictures do not fit in memory, as .gif and .webp need."""
    needed = KEPT.get(path.suffix.lower(), 0) * size[0] * size[1] * count
    if needed > MOST_BYTES:
        raise BenchError(
            f"{path}: {count} pictures of {size[0]} x {size[1]} pixels need {needed / 1e9:.1f} GB of "
            f"memory as {path.suffix.lower()}; write .mp4, or give a smaller --size, --fps, or --start and "
            "--end"
        )


def write_still(path: Path, picture: Image.Image) -> None:
    """One picture as .png. Raises FileError when it cannot be written."""
    with atomic(path) as temporary:
        picture.save(temporary, format="PNG", optimize=True)


def write_clip(path: Path, pictures: Iterable[Image.Image], fps: float) -> None:
    """Pictures of one size at so many per second; drawn as they are written, but for .gif and .webp, whose
    pictures are kept until all are there. Raises FileError when the file cannot be written."""
    with atomic(path) as temporary:
        if path.suffix.lower() == ".mp4":
            _video(path, temporary, pictures, fps)
        elif path.suffix.lower() == ".gif":
            _gif(temporary, pictures, fps)
        else:
            first, *others = pictures
            options = {"duration": _durations(1 + len(others), fps, 1), "loop": 0, "quality": QUALITY}
            first.save(temporary, format="WEBP", save_all=True, append_images=others, **options)


def _durations(count: int, fps: float, step: int) -> list[int]:
    """Milliseconds of every picture, multiples of a step, whose sum never drifts from the rate."""
    ends = np.rint(np.arange(count + 1) * 1000.0 / fps / step).astype(int) * step
    return [max(step, each) for each in np.diff(ends).tolist()]


def _gif(temporary: Path, pictures: Iterable[Image.Image], fps: float) -> None:
    """With one set of colours for all pictures, so that nothing flickers: those of the first ones, and of
    what may light up later."""
    each = iter(pictures)
    begun = list(islice(each, BEGUN))
    sampled = begun[:: max(1, len(begun) // SAMPLED)]
    width, height = begun[0].size
    strip = Image.new("RGB", (width, height * len(sampled) + SWATCH), CONTACT)
    for number, picture in enumerate(sampled):
        strip.paste(picture, (0, number * height))
    colours = strip.quantize(256, method=Image.Quantize.MEDIANCUT)
    first, *others = (
        picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in chain(begun, each)
    )
    durations = _durations(1 + len(others), fps, 10)
    first.save(
        temporary, format="GIF", save_all=True, append_images=others, duration=durations, loop=0, disposal=1
    )


def _video(path: Path, temporary: Path, pictures: Iterable[Image.Image], fps: float) -> None:
    """H.264 that plays everywhere: even sides, colours at half resolution, the index at the beginning."""
    each = iter(pictures)
    first = next(each)
    width, height = first.size
    command = [
        *(ffmpeg(), "-hide_banner", "-loglevel", "error", "-y"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:.6f}", "-i", "-"),
        *("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-c:v", "libx264", "-crf", "20"),
        *("-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(temporary)),
    ]
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors)
        assert process.stdin is not None
        try:
            with suppress(BrokenPipeError):  # ffmpeg gave up, and says why
                for picture in chain([first], each):
                    process.stdin.write(picture.tobytes())
            with suppress(BrokenPipeError):
                process.stdin.close()
        finally:
            if process.poll() is None and not process.stdin.closed:
                process.kill()  # the pictures could not be drawn
            process.wait()
        if process.returncode:
            errors.seek(0)
            words = errors.read().decode(errors="replace").strip().splitlines()
            reason = words[-1] if words else "it does not say why"
            raise FileError(path, f"ffmpeg could not write it ({reason})")
