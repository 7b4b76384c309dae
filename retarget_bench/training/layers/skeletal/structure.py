"""One structure: the statistics beside its networks, the tensors that identify it, and parts of codes."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn

from retarget_bench.errors import BenchError
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skeletal.layout import Layout

ROLES, PARENTS, CAST = "roles", "parents", "cast"
"""Names of the tensors that identify a structure."""
MARKS = (ROLES, PARENTS, CAST)
ROWS = "\n"


class StructureNetworks(nn.Module):
    """The networks of a structure, and mean and deviation of its channels.

    mean, deviation: ``(1 + characters, edges + 1, 4)``: of all its training motion, then of each character
    of ``cast`` where statistics are by character.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, layout: Layout, cast: Sequence[str] = ()) -> None:
        super().__init__()
        self.layout, self.cast = layout, tuple(cast)
        shape = (1 + len(self.cast), layout.edges + 1, 4)
        self.register_buffer("mean", torch.zeros(shape))
        self.register_buffer("deviation", torch.ones(shape))

    @abstractmethod
    def code(self, edges: Tensor, bones: Tensor) -> Tensor:
        """A code of motions ``(rows, frames, edges + 1, 4)``, normalised, of bodies with these bones.

        bones: ``(rows, edges + 1, 3)``, the last of which is zero."""

    @abstractmethod
    def rearranged(self, code: Tensor, source: Layout) -> Tensor:
        """A code of another structure, arranged as this one's decoder reads it."""

    @abstractmethod
    def answer(self, code: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames, edges + 1, 4)`` normalised channels of bodies with these bones.

        code: what ``rearranged`` gives. bones: ``(rows, edges + 1, 3)``."""

    def statistics_row(self, names: Sequence[str]) -> list[int]:
        """Rows of the statistics: a character's own, or 0, that of all."""
        return [1 + self.cast.index(name) if name in self.cast else 0 for name in names]

    def normalised(self, edges: Tensor, row: Tensor) -> Tensor:
        """In deviations from the mean (PAN, eq. 15).

        edges: ``(rows, frames, edges + 1, 4)``; row: ``(rows,)`` of the statistics."""
        return (edges - self.mean[row].unsqueeze(1)) / self.deviation[row].unsqueeze(1)

    def plain(self, edges: Tensor, row: Tensor) -> Tensor:
        """The inverse of ``normalised``."""
        return edges * self.deviation[row].unsqueeze(1) + self.mean[row].unsqueeze(1)

    def with_path(self, edges: Tensor, root: Tensor, row: Tensor) -> Tensor:
        """Normalised edges ``(rows, frames, edges + 1, 4)`` with a root's plain edge ``(rows, frames, 4)``
        added to the last."""
        path = (root - self.mean[row, -1].unsqueeze(1)) / self.deviation[row, -1].unsqueeze(1)
        return torch.cat([edges[:, :, :-1], edges[:, :, -1:] + path.unsqueeze(2)], 2)

    # -------------------------------------------------------------------------------------- as tensors
    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over the tensors of the same structure. Raises BenchError where they do not fit."""
        state = {name: each.float() for name, each in tensors.items() if name not in MARKS}
        try:
            self.load_state_dict(state)
        except RuntimeError as error:
            raise BenchError(f"the weights do not fit this network: {error}") from None

    def marks(self) -> dict[str, Tensor]:
        """Tensors that identify the structure."""
        roles = ROWS.join(role or "" for role in self.layout.roles)
        return {
            PARENTS: torch.tensor(self.layout.parents, dtype=torch.int16),
            ROLES: _bytes(roles),
            CAST: _bytes(ROWS.join(self.cast)),
        }


def named(structures: Mapping[str, StructureNetworks]) -> dict[str, Tensor]:
    """The tensors of all structures, each as ``structure.name``: the inverse of ``by_structure``."""
    return {
        f"{key}.{name}": tensor
        for key, structure in structures.items()
        for name, tensor in (exported(structure) | structure.marks()).items()
    }


def by_structure(tensors: Mapping[str, Tensor]) -> Mapping[str, Mapping[str, Tensor]]:
    """Structure -> its tensors, from all of them by ``structure.name``."""
    structures: dict[str, dict[str, Tensor]] = {}
    for key in sorted(tensors):
        structure, _, name = key.partition(".")
        structures.setdefault(structure, {})[name] = tensors[key]
    return structures


def matching(
    structure: StructureNetworks, name: str, structures: Mapping[str, Mapping[str, Tensor]]
) -> Mapping[str, Tensor]:
    """The tensors of the structure with these joints and characters; of several, those of this name.

    Raises BenchError where there is none.
    """
    marks = structure.marks()

    def same(tensors: Mapping[str, Tensor]) -> bool:
        return all(torch.equal(tensors[key].to(each.dtype), each) for key, each in marks.items())

    fitting = [
        each
        for each in structures
        if all(key in structures[each] for key in MARKS) and same(structures[each])
    ]
    if not fitting:
        raise BenchError(
            f"the weights know no structure with the joints of {name}; they know {', '.join(structures)}"
        )
    return structures[name if name in fitting else fitting[0]]


def described(tensors: Mapping[str, Tensor]) -> tuple[list[int], list[str | None], list[str]]:
    """Parents and roles of the joints, and the cast, that ``StructureNetworks.marks`` wrote down."""
    roles, cast = (_text(tensors[name]).split(ROWS) for name in (ROLES, CAST))
    parents = [int(each) for each in tensors[PARENTS]]
    return parents, [role or None for role in roles], [name for name in cast if name]


def _bytes(text: str) -> Tensor:
    return torch.tensor(list(text.encode()) or [0], dtype=torch.uint8)


def _text(tensor: Tensor) -> str:
    return bytes(tensor.tolist()).decode().strip("\0")


def arranged(code: Tensor, source: Layout, target: Layout) -> Tensor:
    """A code ``(rows, frames, parts, width)`` with the parts of another structure in its order; those that
    the source does not have are zero."""
    if source.names == target.names:
        return code
    there = {name: number for number, name in enumerate(source.names)}
    empty = torch.zeros_like(code[:, :, 0])
    parts = [code[:, :, there[name]] if name in there else empty for name in target.names]
    return torch.stack(parts, 2)
