"""The authors' files: ``retargeting/pretrained`` of github.com/DeepMotionEditing/deep-motion-editing."""

from collections.abc import Iterator

from torch import Tensor

from retarget_bench.training.layers.skeletal.released import (
    MIXAMO,
    SavedNetwork,
    completed,
    of_characters,
)
from retarget_bench.training.layers.skeletal.released_files import ReleasedFiles
from retarget_bench.training.layers.skeletal.structure import named

from .network import Skeletal
from .settings import VARIANTS
from .skeleton import layout_of
from .structure import Structure

LAYERS = {
    "enc.layers.0.0": "encoder.layers.0",
    "enc.layers.1.0": "encoder.layers.1",
    "dec.layers.0.2": "decoder.layers.0",
    "dec.layers.1.2": "decoder.layers.1",
}
"""Layers of the authors' auto-encoder, and ours."""
UNUSED = r"dec\.(enc|unpools)\..+|(enc\.|dec\.)?layers\.\d\.1\.weight"
"""The encoder once more, and poolings, which are of the tree."""


def read(files: ReleasedFiles) -> dict[str, Tensor]:
    """The tensors of all structures. Raises FileError where a file is not SAN's, or of another tree."""
    layouts = {tree.structure: layout_of(tree.parents, tree.roles) for tree in MIXAMO}
    structures = {}
    for paths in files.networks:
        auto_encoder, static_encoder = map(SavedNetwork.read, paths)
        key = auto_encoder.structure("dec.layers.1.2", layouts)
        statistics = of_characters(files.statistics, layouts[key])
        structure = Structure(layouts[key], VARIANTS["released"].design, statistics.cast)
        tensors = parameters(structure, auto_encoder, static_encoder)
        structures[key] = completed(structure, tensors, statistics, paths[0])
    return named(structures)


def parameters(
    structure: Structure, auto_encoder: SavedNetwork, static_encoder: SavedNetwork
) -> Iterator[tuple[str, Tensor]]:
    """The parameters of a structure's networks, by our names. Raises FileError."""
    for layer, own in LAYERS.items():
        yield from layer_parameters(structure, f"{own}.motion", auto_encoder, layer)
        yield from layer_parameters(structure, f"{own}.body", auto_encoder, f"{layer}.offset_enc")
    for number in range(2):
        yield from layer_parameters(
            structure, f"skeleton.layers.{number}", static_encoder, f"layers.{number}.0"
        )
    for network in (auto_encoder, static_encoder):
        network.check_all_taken(UNUSED)


def layer_parameters(
    structure: Structure, own: str, network: SavedNetwork, layer: str
) -> Iterator[tuple[str, Tensor]]:
    """Weight and bias of a skeletal operator. own, layer: our name and theirs."""
    operator = structure.get_submodule(own)
    assert isinstance(operator, Skeletal)
    slots = 1 + operator.pairs[-1][0]
    yield f"{own}.weight", network.blocks(layer, operator.pairs, (slots, slots))
    yield f"{own}.bias", network.take(f"{layer}.bias").view(slots, -1)
