"""Networks that the published code of SAN and PAN saved, as tensors of ``StructureNetworks``.

That code keeps dense weights and a mask beside each; ours are the blocks in which the mask is 1. Its files
do not say what joints they are for: the number of channels tells which of the known trees it is, and the
masks have to be those of that tree.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self, TypeVar

import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.errors import FileError
from retarget_bench.training import torch_files, weights
from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.structure import StructureNetworks

Networks = TypeVar("Networks", bound=StructureNetworks)


@dataclass(frozen=True)
class Tree:
    """The joints of a structure in the order of the authors' code.

    structure: the key of its networks. parents, roles: of the joints, the root (-1) first.
    """

    structure: str
    parents: tuple[int, ...]
    roles: tuple[str | None, ...]


def limb(side: str, *joints: str) -> tuple[str, ...]:
    """The roles of a limb's joints."""
    return tuple(f"{side}_{joint}" for joint in joints)


LEG, ARM = ("up_leg", "leg", "foot", "toe"), ("arm", "forearm", "hand")
MIXAMO = (
    Tree(
        "mixamo-A",
        (-1, *range(4), 0, *range(5, 8), 0, *range(9, 14), 12, *range(15, 18), 12, *range(19, 22)),
        (
            *(None, *limb("left", *LEG), *limb("right", *LEG)),  # the pelvis has no role
            *("hips", "spine_1", "spine_2", "spine_3", "neck", "head"),
            *(*limb("left", "shoulder", *ARM), *limb("right", "shoulder", *ARM)),
        ),
    ),
    Tree(
        "mixamo-B",
        (-1, *range(5), 0, *range(6, 10), 0, *range(11, 17), 14, *range(18, 22), 14, *range(23, 27)),
        (
            *("hips", *limb("left", *LEG, "toe_end"), *limb("right", *LEG, "toe_end")),
            *("spine_1", "spine_2", None, "spine_3", "neck", "head", "head_top"),
            *("left_shoulder", None, *limb("left", *ARM), "right_shoulder", None, *limb("right", *ARM)),
        ),
    ),
)
"""Of Aj, BigVegas, Kaya and SportyGranny, and of the characters in ``_m``; keys as of the data set."""


@dataclass
class SavedNetwork:
    """A network of theirs, whose tensors are taken one by one; ``check_all_taken`` then finds others.

    path: of the file. tensors: those that are not yet taken, by name.
    """

    path: Path
    tensors: dict[str, object]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Raises FileError where it cannot be read. Names of a network on several GPUs begin otherwise."""
        content = torch_files.read(path)
        return cls(path, {name.removeprefix("module."): tensor for name, tensor in content.items()})

    def structure(self, last: str, layouts: Mapping[str, Layout]) -> str:
        """The key of the layout that has as many channels as the bias of the ``last`` layer.

        Raises FileError where none has."""
        channels = self._tensor(f"{last}.bias").numel()
        for key, layout in layouts.items():
            if channels == 4 * (layout.edges + 1):
                return key
        listed = ", ".join(f"{4 * (layout.edges + 1)} ({key})" for key, layout in layouts.items())
        raise FileError(self.path, f"writes {channels} channels; those of known structures are {listed}")

    def take(self, name: str) -> Tensor:
        """A tensor. Raises FileError where it is missing or is not of finite real numbers."""
        tensor = self._tensor(name)
        del self.tensors[name]
        return tensor

    def blocks(self, layer: str, pairs: Sequence[tuple[int, int]], grid: tuple[int, int]) -> Tensor:
        """``(pairs, outputs, inputs, taps)``: the blocks of a layer's weight where its mask is 1.

        pairs: row and column of each. grid: the number of rows and columns. Raises FileError where the mask
        has other blocks.
        """
        weight, mask = self.take(f"{layer}.weight"), self.take(f"{layer}.mask")
        (rows, columns), size = grid, mask.shape
        fits = weight.shape == size and len(size) in (2, 3) and not size[0] % rows and not size[1] % columns
        if fits:
            shape = rows, size[0] // rows, columns, size[1] // columns, -1
            weight, mask = weight.reshape(shape), mask.reshape(shape)
            visible = _chosen(mask, pairs)
            fits = bool((visible == 1.0).all()) and visible.numel() == torch.count_nonzero(mask)
        if not fits:
            raise FileError(
                self.path, f"{layer} has a mask for other joints than those of the known structures"
            )
        return _chosen(weight, pairs)

    def check_all_taken(self, unused: str) -> None:
        """Raises FileError where there are other tensors left than ``unused``, a pattern of names."""
        if others := [name for name in self.tensors if not re.fullmatch(unused, name)]:
            raise FileError(
                self.path, f"holds {others[0]}, which is not in the network of the paper's code"
            )

    def _tensor(self, name: str) -> Tensor:
        if name not in self.tensors:
            raise FileError(self.path, f"lacks {name}, so it is not the network of the paper's code")
        return torch_files.real(self.tensors[name], name, self.path)


def _chosen(blocks: Tensor, pairs: Sequence[tuple[int, int]]) -> Tensor:
    """``(pairs, outputs, inputs, taps)`` of ``(rows, outputs, columns, inputs, taps)``."""
    rows, columns = zip(*pairs, strict=True)
    return blocks.transpose(1, 2)[list(rows), list(columns)]


@dataclass(frozen=True)
class Statistics:
    """mean, deviation: ``(1 + characters, edges + 1, 4)`` as of ``StructureNetworks``. cast: names."""

    cast: tuple[str, ...]
    mean: Tensor
    deviation: Tensor


def of_characters(files: Sequence[Path], layout: Layout) -> Statistics:
    """Those of a structure's characters, told by the number of channels; the first row is their mean.

    files: ``NAME_mean.npy``, then as many ``NAME_var.npy``, which hold deviations. Raises FileError where
    no character is of this structure."""
    half = len(files) // 2
    rows = [
        (mean.name.removesuffix("_mean.npy"), values, torch_files.array(deviation), deviation)
        for mean, deviation in zip(files[:half], files[half:], strict=True)
        if len(values := torch_files.array(mean)) == 4 * layout.edges + 3
    ]
    if not rows:
        raise FileError(
            files[0].parent, f"holds no statistics of {4 * layout.edges + 3} channels, which models need"
        )
    means = torch.stack([_by_edge(each[1], layout, 0.0, files[0]) for each in rows])
    deviations = torch.stack([_deviation(each[2], layout, each[3]) for each in rows])
    mean, deviation = (torch.cat([each.mean(0, keepdim=True), each]) for each in (means, deviations))
    return Statistics(tuple(each[0] for each in rows), mean, deviation)


def of_motions(path: Path, layout: Layout) -> Statistics:
    """Those of all motions of a structure, from an ``.npz`` with their ``mean`` and ``std``."""
    mean, deviation = torch_files.array(path, "mean"), torch_files.array(path, "std")
    rows = _by_edge(mean, layout, 0.0, path), _deviation(deviation, layout, path)
    return Statistics((), *(each.unsqueeze(0) for each in rows))


def _deviation(values: Tensor, layout: Layout, path: Path) -> Tensor:
    if not bool((values > 0.0).all()):
        raise FileError(path, "has deviations that are not above 0")
    return _by_edge(values, layout, 1.0, path)


def _by_edge(values: Tensor, layout: Layout, fourth: float, path: Path) -> Tensor:
    """``(edges + 1, 4)`` of all channels, with a fourth of the root's where these are three."""
    lacking = 4 * (layout.edges + 1) - len(values)
    if lacking not in (0, 1):
        raise FileError(path, f"is of {len(values)} channels, and the networks of {4 * layout.edges + 4}")
    return functional.pad(values, (0, lacking), value=fourth).view(-1, 4)


def completed(
    networks: Networks, tensors: Iterator[tuple[str, Tensor]], statistics: Statistics, path: Path
) -> Networks:
    """The networks with these parameters. path: of their file. Raises BenchError where they do not fit."""
    try:
        parameters = dict(tensors)
    except (RuntimeError, IndexError) as error:  # a view of a tensor of another size
        raise FileError(path, "has tensors of other sizes than the network of the paper's code") from error
    own = {"mean": statistics.mean, "deviation": statistics.deviation}
    weights.fill(networks, parameters | own, str(path))
    return networks
