"""What a file truly is, by its first bytes. Every reader of motion, bodies and meshes asks here first."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from retarget_bench.errors import FileError
from retarget_bench.files import LARGEST, check_ordinary

_SNIFFED = 4096
_MARKERS = "of marker positions, not of a skeleton's motion: solve it in the program that recorded it, and"
_EXPORT = "export it as BVH, FBX or GLB"
_AS_BVH = ": export it as BVH from the program that made it"
_PICKLED = ", which may hold programs and is never loaded: save its arrays as .npz or .npy"


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    words:  what it is ("a zip archive"). begins: pattern of its first bytes, after blanks; capitals are as
            small letters. advice: what to do where it cannot be read. name: by which readers ask for it.
    """

    words: str
    begins: bytes
    advice: str = ""
    name: str = ""

    @cached_property
    def pattern(self) -> re.Pattern[bytes]:
        return re.compile(self.begins, re.IGNORECASE | re.MULTILINE | re.DOTALL)


_ZIPPED = rb"PK\x03\x04.{26}[^\0-\x1f]*?"
"""A zip archive as far as the name of its first member."""
KINDS = (
    Kind("empty", rb"\Z"),
    Kind("a binary FBX file", rb"Kaydara FBX Binary", _AS_BVH, "FBX"),
    Kind("a binary glTF file", rb"glTF", ": export it as BVH", "glTF"),
    Kind("a NumPy archive", _ZIPPED + rb"\.npy", name="NPZ"),
    Kind("a file of PyTorch", _ZIPPED + rb"/data\.pkl", _PICKLED),
    Kind("a zip archive", rb"PK(\x03\x04|\x05\x06)", ": unpack it first"),
    Kind("gzip-compressed", rb"\x1f\x8b", ": unpack it first"),
    Kind("bzip2-compressed", rb"BZh", ": unpack it first"),
    Kind("xz-compressed", rb"\xfd7zXZ", ": unpack it first"),
    Kind("a 7z archive", rb"7z\xbc\xaf", ": unpack it first"),
    Kind("a rar archive", rb"Rar!", ": unpack it first"),
    Kind("a NumPy array", rb"\x93NUMPY", name="NPY"),
    Kind("a pickle of Python", rb"\x80[\x02-\x05]|\([dl]p\d+\n|c(copy_reg|numpy)", _PICKLED),
    Kind("an HDF5 file", rb"\x89HDF"),
    Kind("a Blender scene", rb"BLENDER", f": {_EXPORT}"),
    Kind("a Maya scene", rb"//Maya ASCII|FOR4", f": {_EXPORT}"),
    Kind("a USD scene", rb"#usda|PXR-USDC", f": {_EXPORT}"),
    Kind("a C3D file", rb"[\x01-\x08]P", f" {_MARKERS} {_EXPORT}"),
    Kind("a TRC file", rb"PathFileType", f" {_MARKERS} {_EXPORT}"),
    Kind(
        "a motion of MikuMikuDance",
        rb"Vocaloid Motion Data",
        f": import it with its model into Blender, say, and {_EXPORT}",
    ),
    Kind("a PLY mesh", rb"ply\s", name="PLY"),
    Kind("an XML file", rb"<\?xml"),
    Kind("a JSON file", rb"\{", name="glTF"),
    Kind("UTF-16 text", rb"\xff\xfe|\xfe\xff", ": save it as UTF-8"),
    Kind("a BVH file", rb"HIERARCHY\b|.*?(^|\r)[ \t]*HIERARCHY[ \t]*($|\r|ROOT)", name="BVH"),
    Kind("an Acclaim motion (AMC)", rb".*?^\s*(:fully-specified|:degrees|:radians|#!oml:asf)", name="AMC"),
    Kind("an Acclaim skeleton (ASF)", rb".*?^\s*(:version|:units|:bonedata|# ast/asf)", name="ASF"),
    Kind("an ASCII FBX file", rb".*?(FBXHeaderExtension|; FBX )", _AS_BVH, "FBX"),
    Kind("binary data of an unknown kind", rb".*\0"),
    Kind("text of an unknown kind", rb""),
)
"""Kinds of files; the first that fits is right."""
EMPTY, TEXT = KINDS[0], KINDS[-1]


def kind_of(path: Path) -> Kind:
    """The kind of a file. Raises FileError for what is no ordinary file or too large, cannot be read, or
    stands in for a file (a pointer of Git LFS, a web page)."""
    check_ordinary(path, LARGEST)
    try:
        with path.open("rb") as file:
            head = file.read(_SNIFFED)
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    return next(kind for kind in KINDS if kind.pattern.match(text))


def check_kind(path: Path, *names: str, text: bool = False) -> Kind:
    """The kind of a file that is to be read as one of these. text: text of no known kind is for the reader
    to judge. Raises FileError, in the words of what it is, for every other kind."""
    kind = kind_of(path)
    if kind.name in names or (text and kind is TEXT):
        return kind
    known = "" if kind is EMPTY else f"not {' or '.join(names)} but "
    raise FileError(path, f"is {known}{kind.words}{kind.advice}")
