"""A motion put into the GLB or glTF file of its body: mesh, skin, materials and other animations stay."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files.gltf.document import Document, open_document
from retarget_bench.motion.files.gltf.reading import GltfScene
from retarget_bench.motion.files.gltf.writing import AnimationBuilder, Builder, check_frames
from retarget_bench.motion.files.scenes.reading import rigged
from retarget_bench.motion.files.scenes.rig import Rig, is_plain
from retarget_bench.motion.files.scenes.scene import Nodes
from retarget_bench.motion.importer import Imported, as_stated, places_as_stated
from retarget_bench.motion.recording import Recording, reach

_ANGLE, _PLACE = 1e-2, 1e-5
"""Degrees, and shares of the body's reach, by which a written file may differ from the motion: numbers in
it are single precision."""
_PICTURES = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".webp": "image/webp"}


def write(
    path: str | Path, motion: Motion, like: Imported, *, places: np.ndarray | None = None
) -> tuple[str, ...]:
    """Write a motion of the body of ``like`` into a copy of that file; returns what could not be kept.

    The motion is the first of the copy's animations, under the name of the new file. Whatever else the
    file has is kept: the numbers of its own buffer byte for byte, and before all others.
    places: ``(frames, joints, 3)`` metres, every joint in its parent's frame, where joints below the root
    move there; None: bones keep their length.
    The file is read back before it takes its name; nothing is left behind where it is another motion.
    Raises FileError where the motion cannot be stated on the file's nodes.
    """
    path, source = Path(path), like.findings.path
    check_frames(path, motion)
    document = open_document(source)
    rig, recording = rigged(GltfScene(document), like.reading.take, like.reading.body)
    builder, notes = _copied(document)
    expected = as_stated(motion, like)
    animation = AnimationBuilder(builder, path.stem, motion.frames, motion.fps)
    steps = None
    if places is not None and is_plain(rig.nodes, rig.body):
        steps = places_as_stated(places, like)
    if places is not None and steps is None:
        notes = (*notes, "nodes are scaled unevenly: positions of inner joints are left out")
    _fill(animation, rig, rig.scene.nodes, expected, steps)
    builder.content["animations"] = [animation.finished(), *builder.content.get("animations", [])]
    with atomic(path) as temporary:
        builder.save(temporary)
        reread = rigged(GltfScene(open_document(temporary)), path.stem, like.reading.body)[1]
        _check(path, reread, replace(recording, rotations=expected.rotations, root=expected.root))
    return notes


def _fill(
    animation: AnimationBuilder, rig: Rig, resting: Nodes, motion: Motion, steps: np.ndarray | None
) -> None:
    """The tracks of the body's nodes: turns of all, places of the root, and whatever differs from rest.

    steps: ``(frames, joints, 3)`` every joint in its parent's frame where joints below the root move there.
    """
    joints, parents = rig.body.joints, rig.skeleton.parents
    turned = rotation.multiply(motion.rotations, rig.orientation)
    turned[:, 1:] = rotation.multiply(rotation.conjugate(rig.orientation[parents[1:]]), turned[:, 1:])
    place, heading, size = np.zeros(3), rotation.identity(), 1.0
    for node in rig.nodes.above(joints[0]):
        place = place + rotation.rotate(heading, size * rig.nodes.translation[node])
        heading = rotation.multiply(heading, rig.nodes.rotation[node])
        size *= float(rig.nodes.scale[node].mean())
    back = rotation.conjugate(heading)
    turned[:, 0] = rotation.multiply(back[None], turned[:, 0])
    animation.track(joints[0], "translation", rotation.rotate(back[None], motion.root - place) / size)
    for joint, node in enumerate(joints):
        animation.track(node, "rotation", rotation.continuous(turned[:, joint : joint + 1])[:, 0])
        if joint and steps is not None and np.ptp(steps[:, joint], axis=0).any():
            animation.track(node, "translation", rig.translations(joint, steps[:, joint]))
        elif joint and not np.allclose(rig.places[joint], resting.translation[node], rtol=1e-6, atol=0):
            animation.track(node, "translation", rig.places[joint][None])
    for node in (*rig.nodes.above(joints[0]), *joints):
        if not np.allclose(rig.nodes.scale[node], resting.scale[node], rtol=1e-6, atol=0):
            animation.track(node, "scale", rig.nodes.scale[node][None])


def _check(path: Path, written: Recording, expected: Recording) -> None:
    """Raise FileError where the file that was written holds another motion than the one it should."""
    if written.rotations.shape != expected.rotations.shape:
        raise FileError(path, "not written: the target's file cannot hold this motion beside its own")
    turned = np.degrees(rotation.angle(written.rotations, expected.rotations)).max()
    moved = float(np.abs(written.root - expected.root).max()) / max(reach(expected.skeleton), 1e-9)
    size = float(np.abs(expected.root).max()) / max(reach(expected.skeleton), 1e-9)
    if turned > _ANGLE or moved > _PLACE * max(size, 1.0):
        raise FileError(
            path,
            "not written: the nodes of the target's file cannot state this motion, scaled as they are "
            f"(off by {turned:.2g} degrees, {moved:.2g} of the body's size at the root)",
        )


# ------------------------------------------------------------------------------------ the file's copy
def _copied(document: Document) -> tuple[Builder, tuple[str, ...]]:
    """The file with all its buffers as one, and pictures that lie beside it taken in."""
    content = copy.deepcopy(document.content)
    starts, data = [], bytearray()
    for number in range(len(document.items("buffers"))):
        data += b"\0" * (-len(data) % 4)
        starts.append(len(data))
        data += document.buffer(number)
    for number, item in enumerate(document.items("bufferViews")):
        by = f"bufferViews[{number}]"
        packed = document.inside(item, "extensions", by)
        document.view(number, "the file")  # says what is wrong with it
        start = starts[document.integer(item, "buffer", by)]
        if start and packed:
            raise document.fail(f"{by} is compressed, and cannot be moved: export the file as GLB")
        view = content["bufferViews"][number]
        view["byteOffset"] = document.integer(item, "byteOffset", by, 0) + start
        view["buffer"] = 0
    builder = Builder(content, bytes(data))
    return builder, tuple(_pictures(document, builder))


def _pictures(document: Document, builder: Builder) -> list[str]:
    """Take pictures beside the file into it; notes on those that are not there."""
    notes = []
    for number in range(len(document.items("images"))):
        image = builder.content["images"][number]
        uri = image.get("uri")
        if not isinstance(uri, str) or uri.startswith("data:"):
            continue
        try:
            data = document.linked(uri, f"images[{number}]")
            kind = _PICTURES[Path(uri).suffix.lower()]
        except FileError as error:
            notes.append(f"a picture is not taken along: {error.problem}")
        except KeyError:
            notes.append(f"the picture {uri!r} is of another kind than PNG and JPEG, and not taken along")
        else:
            del image["uri"]
            image["mimeType"] = kind
            image["bufferView"] = builder.bytes_view(data)
    return notes
