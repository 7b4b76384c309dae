"""The discriminators, one for each structure, and what they remember of earlier answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn

from retarget_bench.training.contract import Terms

from . import losses
from .design import Design
from .losses import Weights
from .network import Discriminator

POOL = 50


class Judges(nn.Module):
    """slots: structure -> how many it has. frames: of a window."""

    def __init__(self, slots: Mapping[str, int], frames: int, design: Design, weights: Weights) -> None:
        super().__init__()
        per_slot, root = {"motion": (4, 4), "bones": (3, 4), "places": (3, 3)}[weights.judge]
        channels = {name: per_slot * count + root for name, count in slots.items()}
        self.discriminators = nn.ModuleDict(
            {name: Discriminator(count, design) for name, count in channels.items()}
        )
        pools = {name: Pool(frames, count) for name, count in channels.items()} if weights.pool else {}
        self.pools = nn.ModuleDict(pools)

    def fooled(self, name: str, seen: Tensor) -> Tensor:
        """How far from real the answers ``(rows, frames, channels)`` look."""
        return losses.fooled(self.discriminators[name](seen))

    def told_apart(self, shown: Sequence[tuple[str, Tensor, Tensor]]) -> Terms:
        """The discriminators' loss; shown: structure, real motion, answers."""
        found = []
        for name, real, answers in shown:
            if name in self.pools:
                answers = self.pools[name](answers)
            judge = self.discriminators[name]
            found.append(losses.told_apart(judge(real), judge(answers)))
        if not found:
            return {}
        unused = [
            each for name, each in self.discriminators.items() if name not in {n for n, _, _ in shown}
        ]
        idle = [0.0 * parameter.sum() for each in unused for parameter in each.parameters()]
        return {"told_apart": torch.stack(found).mean() + (torch.stack(idle).sum() if idle else 0.0)}


class Pool(nn.Module):
    """The last answers: each new one is judged with probability one half, else it takes an old one's place,
    which is judged instead (Shrivastava et al., CVPR 2017, as in the released code)."""

    kept: Tensor
    count: Tensor

    def __init__(self, frames: int, channels: int) -> None:
        super().__init__()
        self.register_buffer("kept", torch.zeros(POOL, frames, channels))
        self.register_buffer("count", torch.tensor(0))

    def forward(self, answers: Tensor) -> Tensor:
        """``(rows, frames, channels)`` what is to be judged. Drawn on the processor, so that a GPU judges
        the same ones."""
        judged, many = answers.clone(), int(self.count)
        kept, places = torch.rand(len(answers)) < 0.5, torch.randint(POOL, (len(answers),))
        for row, (own, place) in enumerate(zip(kept.tolist(), places.tolist(), strict=True)):
            if many < POOL:
                self.kept[many] = answers[row]
                many += 1
            elif not own:
                judged[row] = self.kept[place]
                self.kept[place] = answers[row]
        self.count.fill_(many)
        return judged
