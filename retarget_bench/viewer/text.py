"""Text in pictures: a font with many scripts, and safe, short names."""

import unicodedata
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from PIL import ImageFont

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

_FONTS = "mpl-data/fonts/ttf"
"""In matplotlib, whose DejaVu Sans knows more letters than Pillow's own font."""


@lru_cache(maxsize=32)
def font(pixels: int, bold: bool = False) -> Font:
    """DejaVu Sans of a size; Pillow's own font where it is not there."""
    spec = find_spec("matplotlib")
    if spec is not None and spec.origin is not None:
        path = Path(spec.origin).parent / _FONTS / f"DejaVuSans{'-Bold' if bold else ''}.ttf"
        if path.exists():
            return ImageFont.truetype(str(path), pixels)
    return ImageFont.load_default(pixels)


def plain(text: str) -> str:
    """Text on one line without characters that have no shape or change the direction of others."""
    spaced = "".join(" " if unicodedata.category(sign)[0] in "ZC" else sign for sign in text)
    return " ".join(spaced.split())


def short(text: str, letters: Font, room: float) -> str:
    """Text that takes at most ``room`` pixels; a longer one loses its middle."""
    text = plain(text)
    if letters.getlength(text) <= room:
        return text
    low, high = 0, len(text)
    while low < high:
        keep = (low + high + 1) // 2
        low, high = (keep, high) if letters.getlength(_cut(text, keep)) <= room else (low, keep - 1)
    return _cut(text, low)


def _cut(text: str, keep: int) -> str:
    """The first and last signs of a text, ``keep`` in all."""
    end = keep // 3
    return f"{text[: keep - end]}…{text[len(text) - end :]}" if keep else "…"


def wrapped(text: str, letters: Font, room: float, lines: int) -> list[str]:
    """Text on lines of at most ``room`` pixels; at most so many, the last one cut where more is left."""
    words, out = plain(text).split(), [""]
    for number, word in enumerate(words):
        longer = f"{out[-1]} {word}".strip()
        if letters.getlength(longer) <= room or not out[-1]:
            out[-1] = longer
        elif len(out) == lines:
            out[-1] = " ".join([out[-1], *words[number:]])
            break
        else:
            out.append(word)
    return [short(line, letters, room) for line in out if line]
