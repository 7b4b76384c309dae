"""The nodes of a glTF file (specification of glTF 2.0, section 3.5)."""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.files.gltf.document import Document
from retarget_bench.motion.files.scenes.nodes import DEEPEST, MOST_NODES, Nodes, decomposed


def read_nodes(document: Document) -> Nodes:
    """The nodes of a file. Raises FileError where they form no forest, or a transform is not finite."""
    items = document.items("nodes")
    count = len(items)
    if count > MOST_NODES:
        raise document.fail(f"has {count} nodes; files of up to {MOST_NODES} are read")
    parents, children = [-1] * count, []
    for number, item in enumerate(items):
        below = document.listed(item, "children", f"nodes[{number}]", int)
        for child in below:
            document.item("nodes", child, f"nodes[{number}]")
            if parents[child] >= 0:
                raise document.fail(f"nodes[{child}] is a child of two nodes: the file is damaged")
            parents[child] = number
        children.append(below)
    depths = _depths(document, parents, children)
    if max(depths, default=0) > DEEPEST:
        raise document.fail(f"has nodes {max(depths)} deep; up to {DEEPEST} are read: it is damaged")
    translation = np.zeros((count, 3))
    turned, scale = rotation.identity(count), np.ones((count, 3))
    for number, item in enumerate(items):
        name = f"nodes[{number}]"
        if (matrix := document.numbers(item, "matrix", 16, name)) is not None:
            parts = decomposed(matrix.reshape(4, 4).T)
            translation[number], turned[number], scale[number] = parts
        if (value := document.numbers(item, "translation", 3, name)) is not None:
            translation[number] = value
        if (value := document.numbers(item, "rotation", 4, name)) is not None:
            turned[number] = value[[3, 0, 1, 2]]
        if (value := document.numbers(item, "scale", 3, name)) is not None:
            scale[number] = value
    return Nodes(document.names, parents, children, depths, translation, rotation.normalise(turned), scale)


def _depths(document: Document, parents: list[int], children: list[list[int]]) -> list[int]:
    """Steps of every node from the top. Raises FileError where nodes form a circle."""
    depths = [-1] * len(parents)
    waiting = [node for node, parent in enumerate(parents) if parent < 0]
    for node in waiting:
        depths[node] = 0
    while waiting:
        node = waiting.pop()
        for child in children[node]:
            depths[child] = depths[node] + 1
            waiting.append(child)
    if -1 in depths:
        raise document.fail(f"nodes[{depths.index(-1)}] stands below itself: its nodes form a circle")
    return depths
