"""Kinds of files, by what they begin with."""

KINDS = {
    "a binary FBX file: export it as BVH from the program that made it": (b"Kaydara FBX Binary",),
    "an ASCII FBX file: export it as BVH from the program that made it": (b"; FBX",),
    "a binary glTF file: export it as BVH": (b"glTF",),
    "a zip archive: unpack it first": (b"PK\x03\x04",),
    "gzip-compressed: unpack it first": (b"\x1f\x8b",),
    "bzip2-compressed: unpack it first": (b"BZh",),
    "xz-compressed: unpack it first": (b"\xfd7zXZ",),
    "a 7z archive: unpack it first": (b"7z\xbc\xaf",),
    "a rar archive: unpack it first": (b"Rar!",),
    "a Blender scene: export it as BVH, FBX or GLB": (b"BLENDER",),
    "a Maya scene: export it as BVH, FBX or GLB": (b"//Maya ASCII", b"FOR4"),
    "a USD scene: export it as BVH, FBX or GLB": (b"#usda", b"PXR-USDC"),
    "a NumPy array": (b"\x93NUMPY",),
    "an HDF5 file": (b"\x89HDF",),
    "an XML file": (b"<?xml",),
    "an Acclaim skeleton (ASF)": (b"# AST/ASF", b":version"),
    "an Acclaim motion (AMC)": (b"#!OML:ASF", b":FULLY-SPECIFIED"),
    "a JSON file": (b"{",),
}
"""Kinds of other files -> what they begin with."""
_HEAD = 64
"""Bytes that tell them."""


def kind_of(head: bytes) -> str:
    """The kind of file that begins with these bytes, with what to do; "" for others."""
    head = head.removeprefix(b"\xef\xbb\xbf").lstrip()[:_HEAD].lower()
    fits = (any(head.startswith(each.lower()) for each in beginnings) for beginnings in KINDS.values())
    return next((kind for kind, fit in zip(KINDS, fits, strict=True) if fit), "")
