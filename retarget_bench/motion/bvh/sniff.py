"""Recognising what is not BVH under the name of one, from its first bytes."""

_SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (
        b"version https://git-lfs",
        "a Git LFS pointer, not the motion itself: run `git lfs pull` where it came from",
    ),
    (
        b"version http://git-media",
        "a Git LFS pointer, not the motion itself: run `git lfs pull` where it came from",
    ),
    (
        b"/annex/objects",
        "a git-annex pointer, not the motion itself: run `git annex get` where it came from",
    ),
    (b"Kaydara FBX Binary", "a binary FBX file: export it as BVH from the program that made it"),
    (b"; FBX", "an ASCII FBX file: export it as BVH from the program that made it"),
    (b"glTF", "a binary glTF file: export it as BVH"),
    (b"PK\x03\x04", "a zip archive: unpack it first"),
    (b"\x1f\x8b", "gzip-compressed: unpack it first"),
    (b"BZh", "bzip2-compressed: unpack it first"),
    (b"\xfd7zXZ", "xz-compressed: unpack it first"),
    (b"7z\xbc\xaf", "a 7z archive: unpack it first"),
    (b"Rar!", "a rar archive: unpack it first"),
    (b"BLENDER", "a Blender scene: export it as BVH"),
    (b"//Maya ASCII", "a Maya scene: export it as BVH"),
    (b"FOR4", "a Maya scene: export it as BVH"),
    (b"#usda", "a USD scene: export it as BVH"),
    (b"PXR-USDC", "a USD scene: export it as BVH"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"\x89HDF", "an HDF5 file"),
    (b"<!DOCTYPE", "a web page: the download gave an error page instead of the file"),
    (b"<html", "a web page: the download gave an error page instead of the file"),
    (b"<?xml", "an XML file"),
    (b"# AST/ASF", "an Acclaim skeleton (ASF): convert ASF and AMC together to BVH"),
    (b":version", "an Acclaim skeleton (ASF): convert ASF and AMC together to BVH"),
    (b"#!OML:ASF", "an Acclaim motion (AMC): convert ASF and AMC together to BVH"),
    (b":FULLY-SPECIFIED", "an Acclaim motion (AMC): convert ASF and AMC together to BVH"),
    (b"{", "a JSON file"),
)
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_BOM = b"\xef\xbb\xbf"


def without_mark(data: bytes) -> bytes:
    """The bytes without the mark that some editors put before UTF-8 text."""
    return data.removeprefix(_BOM)


def complaint(start: bytes) -> str | None:
    """The fault of a file that starts with these bytes (some thousand), or None if it may be BVH."""
    if not start:
        return "is empty"
    if start.startswith(_UTF16):
        return "is UTF-16 text: save it as UTF-8"
    text = without_mark(start).lstrip()
    if not text:
        return "holds only blanks"
    if text[:9].upper() == b"HIERARCHY":
        return None
    for signature, meaning in _SIGNATURES:
        if text[: len(signature)].lower() == signature.lower():
            return f"is not BVH but {meaning}"
    if b"\0" in start:
        return "is not BVH but binary data of an unknown kind"
    first = text.splitlines()[0][:40].decode("ascii", "replace")
    return f"is not BVH: it begins with {first!r} instead of HIERARCHY"
