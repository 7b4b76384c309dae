"""The authors' files: what ``download_pretrained.sh`` of github.com/hlcdyy/pan-motion-retargeting gets."""

from collections.abc import Iterator, Sequence

from torch import Tensor

from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.released import (
    ARM,
    LEG,
    MIXAMO,
    SavedNetwork,
    Tree,
    completed,
    limb,
    of_characters,
    of_motions,
)
from retarget_bench.training.layers.skeletal.released_files import ReleasedFiles
from retarget_bench.training.layers.skeletal.structure import named

from .network import convolved_parts, seen_bones, written
from .parts import BY_NAME, layout_of
from .settings import Design
from .structure import Structure

PERSON = Tree(
    "lafan22",
    (-1, *range(4), 0, *range(5, 8), 0, *range(9, 13), 11, *range(14, 17), 11, *range(18, 21)),
    (
        *("hips", *limb("left", *LEG), *limb("right", *LEG)),
        *("spine_1", "spine_2", "spine_3", "neck", "head"),
        *(*limb("left", "shoulder", *ARM), *limb("right", "shoulder", *ARM)),
    ),
)
DOG = Tree(
    "mann21_four_legged",
    (-1, 0, 1, 2, 3, 2, 5, 6, 7, 2, 9, 10, 11, 0, 13, 14, 0, 16, 17, 0, 19),
    (
        *("hips", "spine_1", "spine_2", "neck", "head"),
        *(*limb("left", "shoulder", *ARM), *limb("right", "shoulder", *ARM)),
        *(*limb("left", *LEG[:3]), *limb("right", *LEG[:3]), "tail_1", "tail_2"),
    ),
)
"""LAFAN1's person and MANN's dog; keys as of the data set."""
EMBEDDING = {"embedding.0": "joint_pos_encoder.linear1", "embedding.1": "joint_pos_encoder.linear2"}
WITHIN_PARTS = {
    "encoder.convolutions.0": "enc.conv1",
    "encoder.convolutions.1": "enc.conv2",
    "decoder.inner": "dec.layers.0.1",
}
"""Our layers, and the authors'."""
ATTENTION = {
    "qkv.weight": "self_attn.in_proj_weight",
    "qkv.bias": "self_attn.in_proj_bias",
    **{
        f"block.{own}.{kind}": f"{layer}.{kind}"
        for kind in ("weight", "bias")
        for own, layer in {
            "out": "self_attn.out_proj",
            "feed.0": "linear1",
            "feed.1": "linear2",
            "norms.0": "norm1",
            "norms.1": "norm2",
        }.items()
    },
}
"""Parameters of a layer of attention, and those of torch's transformer."""
UNUSED = r"enc\.joint_pos_encoder\.pe"
"""The code of the edges' indices."""


def read(files: ReleasedFiles, parts: str, design: Design) -> dict[str, Tensor]:
    """The tensors of all structures. Raises FileError where a file is not PAN's, or of another tree."""
    trees = (PERSON, DOG) if parts == "three" else MIXAMO
    layouts = {
        tree.structure: layout_of(tree.parents, tree.roles, BY_NAME[parts], tree is DOG, design.slots)
        for tree in trees
    }
    structures = {}
    for number, paths in enumerate(files.networks):
        auto_encoder, static_encoder = map(SavedNetwork.read, paths)
        key = auto_encoder.structure("dec.layers.1.1", layouts)
        if parts == "three":
            statistics = of_motions(files.statistics[number], layouts[key])
        else:
            statistics = of_characters(files.statistics, layouts[key])
        structure = Structure(layouts[key], design, statistics.cast)
        tensors = parameters(structure, design, auto_encoder, static_encoder)
        structures[key] = completed(structure, tensors, statistics, paths[0])
    return named(structures)


def parameters(
    structure: Structure, design: Design, auto_encoder: SavedNetwork, static_encoder: SavedNetwork
) -> Iterator[tuple[str, Tensor]]:
    """The parameters of a structure's networks, by our names. Raises FileError."""
    layout = structure.layout
    parts, edges = len(layout.parts), layout.edges + 1
    yield "encoder.tokens", auto_encoder.take("enc.parameter_part").squeeze(1)
    for own, layer in EMBEDDING.items():
        for kind in ("weight", "bias"):
            yield f"encoder.{own}.{kind}", auto_encoder.take(f"enc.{layer}.{kind}")
    for number in range(design.layers):
        for own, name in ATTENTION.items():
            released = f"enc.spatialTransEncoder.layers.{number}.{name}"
            yield f"encoder.layers.{number}.{own}", auto_encoder.take(released)
    for own, layer in WITHIN_PARTS.items():
        weight = auto_encoder.blocks(layer, _diagonal(parts), (parts, parts))
        yield f"{own}.weight", weight.flatten(0, 1)
        yield f"{own}.bias", auto_encoder.take(f"{layer}.bias")
    read = _pairs(convolved_parts(layout, design))
    raw = auto_encoder.blocks("enc.conv_residual", read, (parts, edges))
    yield "encoder.raw.weight", raw.transpose(1, 2).flatten(0, 1)
    yield "encoder.raw.bias", auto_encoder.take("enc.conv_residual.bias")
    writing = [(edge, part) for part, edge in _pairs(written(layout, design))]
    outer = auto_encoder.blocks("dec.layers.1.1", writing, (edges, parts))
    yield "decoder.outer.weight", outer.flatten(0, 1)
    yield "decoder.outer.bias", auto_encoder.take("dec.layers.1.1.bias")
    yield from _of_bones(layout, design, static_encoder)
    auto_encoder.check_all_taken(UNUSED)
    static_encoder.check_all_taken("")


def _of_bones(layout: Layout, design: Design, network: SavedNetwork) -> Iterator[tuple[str, Tensor]]:
    """The parameters of the encoder of skeletons, which reads the bone to each joint: of edges the root's
    first, which we have last; of joints not the root's."""
    parts, bones = len(layout.parts), len(layout.parents)
    if layout.slots == "edges":
        columns = [(part, (edge + 1) % bones) for part, edge in _pairs(seen_bones(layout, design))]
    else:
        bones -= 1
        columns = [(part, joint - 1) for part, joint in _pairs(seen_bones(layout, design))]
    for number in range(3):
        layer, first = f"linear{number + 1}", number == 0
        pairs, grid = (columns, (parts, bones)) if first else (_diagonal(parts), (parts, parts))
        weight = network.blocks(layer, pairs, grid)
        yield f"skeleton.layers.{number}.weight", weight.squeeze(-1).transpose(1, 2).flatten(0, 1)
        yield f"skeleton.layers.{number}.bias", network.take(f"{layer}.bias").view(parts, -1)


def _pairs(parts: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    """Part and member, part by part."""
    return [(part, member) for part, members in enumerate(parts) for member in members]


def _diagonal(count: int) -> list[tuple[int, int]]:
    return [(number, number) for number in range(count)]
