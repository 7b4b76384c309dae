"""What an iteration of PAN costs, and how fast it retargets, beside the same networks built the plain way.

Run it with ``python tests/benchmarks/pan_speed.py [--threads N] [--rounds N] [--rows N] [--clips N]
[--profile] [--only lean|plain] [--products] [--together]``. One iteration is a step of the generator and
one of the discriminators with the released choices: two structures (22 and 27 edges), windows of 64 frames,
and the released losses: reconstruction, cycles and end effectors of all four pairs, adversarial for the two
that change the structure. Each encoder sees its sources once, and once the answers on its structure.
The plain networks are ``tests/methods/pan_reference.py``: dense layers times masks. Both do the same work
around the networks.
``--together`` times as many processes as threads, each with its share of the rows and one thread, which add
up their gradients, as ``torchrun ... bench train`` has them; peak memory is then that of each.
``--products`` times bare products of matrices of the sizes that edges are embedded with, and nothing else.
Processor time is given beside wall time, because other processes on the machine move it less. Peak memory
is that of the whole process; the lean networks go first.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, distributed, nn
from torch.nn import functional
from torch.profiler import ProfilerActivity, profile

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1] / "methods"))

from pan_reference import S23, S28, PlainDecoder, PlainEncoder, PlainSkeletonEncoder

from retarget_bench.methods.pan.network import Decoder, Discriminator, Encoder, SkeletonEncoder
from retarget_bench.methods.pan.settings import RELEASED
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.layers.skeletal.layout import Layout

LAYOUTS = (S23, S28)
FRAMES, LONG = 64, 600


class Structure(nn.Module):
    """The networks of one structure, and its kinematics."""

    def __init__(self, layout: Layout, plain: bool) -> None:
        super().__init__()
        self.layout, joints = layout, len(layout.parents)
        self.encoder: nn.Module = Encoder(layout, RELEASED)
        self.skeleton: nn.Module = SkeletonEncoder(layout, RELEASED)
        self.decoder: nn.Module = Decoder(layout, RELEASED)
        if plain:
            self.encoder = PlainEncoder(self.encoder, layout, RELEASED)
            self.skeleton = PlainSkeletonEncoder(self.skeleton, layout, RELEASED)
            self.decoder = PlainDecoder(self.decoder, layout, RELEASED)
        names = tuple(f"j{k}" for k in range(joints))
        self.tree = Tree.of(Skeleton(names, np.array(layout.parents), np.ones((joints, 3))))
        carriers = [layout.parents[1:].index(k) if k in layout.parents[1:] else -1 for k in range(joints)]
        self.carriers = torch.tensor(carriers)
        self.turned = self.carriers.view(-1, 1) >= 0
        self.above = torch.tensor([max(parent, 0) for parent in layout.parents])
        self.ends = torch.tensor([k for k in range(joints) if k not in layout.parents])

    def answer(self, code: Tensor, bones: Tensor) -> Tensor:
        return self.decoder(code + self.skeleton(bones).unsqueeze(1))

    def positions(self, motion: Tensor, bones: Tensor) -> Tensor:
        """Joints ``(rows, frames, joints, 3)``."""
        still = motion.new_tensor([1.0, 0.0, 0.0, 0.0])
        turns = torch.where(self.turned, motion.index_select(2, self.carriers.clamp(min=0)), still)
        offsets = torch.cat([bones[:, -1:], bones[:, :-1]], 1)
        turns = functional.normalize(turns, dim=-1)
        return kinematics(self.tree, offsets, turns, motion[:, :, -1, :3].contiguous())[0]

    def shown(self, positions: Tensor) -> Tensor:
        """What a discriminator sees."""
        vectors = positions - positions.index_select(2, self.above)
        return torch.cat([positions[:, :, :1], vectors[:, :, 1:]], 2).flatten(2)


class Iteration:
    """Both steps, on random motions and bodies."""

    def __init__(self, rows: int, plain: bool) -> None:
        torch.manual_seed(0)
        self.rows = rows
        self.structures = nn.ModuleList(Structure(layout, plain) for layout in LAYOUTS)
        self.discriminators = nn.ModuleList(
            Discriminator(3 * (each.edges + 1), RELEASED) for each in LAYOUTS
        )
        self.optimisers = [
            torch.optim.Adam(each.parameters(), 1e-3) for each in (self.structures, self.discriminators)
        ]
        self.motions = [torch.randn(rows, FRAMES, each.edges + 1, 4) for each in LAYOUTS]
        self.bones = [
            torch.cat([torch.randn(rows, each.edges, 3), torch.zeros(rows, 1, 3)], 1) for each in LAYOUTS
        ]

    def __call__(self) -> None:
        loss, judged = self.generate()
        self._update(0, loss)
        real_and_fake = []
        for discriminator, (real, fake) in zip(self.discriminators, judged, strict=True):
            scores = discriminator(torch.cat([real, fake.detach()]))
            real_and_fake.append(
                (scores[: self.rows] - 1).square().mean() + scores[self.rows :].square().mean()
            )
        self._update(1, 0.5 * (real_and_fake[0] + real_and_fake[1]))

    def _update(self, which: int, loss: Tensor) -> None:
        optimiser = self.optimisers[which]
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        if distributed.is_initialized():
            parameters = [each for group in optimiser.param_groups for each in group["params"]]
            whole = torch.cat([each.grad.flatten() for each in parameters])
            distributed.all_reduce(whole)
            for each, grad in zip(parameters, whole.split([p.numel() for p in parameters]), strict=True):
                each.grad.copy_(grad.view_as(each) / distributed.get_world_size())
        optimiser.step()

    def generate(self) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
        """The generator's loss; of each structure what is real and what is not, for the discriminator."""
        sides = range(len(LAYOUTS))
        codes = [each.encoder(motion) for each, motion in zip(self.structures, self.motions, strict=True)]
        real = [self.structures[k].positions(self.motions[k], self.bones[k]) for k in sides]
        terms, judged, again = [], [], []
        for k, structure in enumerate(self.structures):
            rows = torch.cat([*codes, codes[k]])
            bones = torch.cat([self.bones[k].flip(0), self.bones[k].roll(1, 0), self.bones[k]])
            answers = structure.answer(rows, bones)
            positions = structure.positions(answers, bones)
            terms.append(functional.mse_loss(answers[-self.rows :], self.motions[k]))
            terms.append(100.0 * functional.mse_loss(positions[-self.rows :], real[k]))
            again.append(structure.encoder(answers[: -self.rows]).chunk(len(sides)))
            for j, own in zip(sides, positions.split(self.rows), strict=False):
                terms.append(
                    50.0 * self._follow(own[:, :, structure.ends], real[j][:, :, self.structures[j].ends])
                )
                if j != k:
                    seen = structure.shown(own)
                    terms.append((self.discriminators[k](seen) - 1).square().mean())
                    judged.append((structure.shown(real[k]), seen))
        for k, structure in enumerate(self.structures):
            back = [again[j][k] for j in sides]
            bones = torch.cat([self.bones[k]] * len(back))
            returned = structure.positions(structure.answer(torch.cat(back), bones), bones)
            terms.append(2.5 * functional.mse_loss(returned, torch.cat([real[k]] * len(back))))
            terms.append(2.5 * sum((code - codes[k]).abs().mean() for code in back))
        return torch.stack(terms).sum(), judged

    @staticmethod
    def _follow(answer: Tensor, source: Tensor) -> Tensor:
        moved, wanted = 10.0 * answer.diff(dim=1), 10.0 * source.diff(dim=1)
        rests = moved.detach().norm(dim=-1, keepdim=True) < 0.008
        return functional.mse_loss(moved, wanted) + 100.0 * functional.mse_loss(
            moved * rests, wanted * rests
        )


def inference(structures: nn.ModuleList, rows: int) -> Callable[[], None]:
    """From 27 edges to 22, networks alone."""
    motion = torch.randn(rows, LONG, S28.edges + 1, 4)
    bones = torch.cat([torch.randn(rows, S23.edges, 3), torch.zeros(rows, 1, 3)], 1)

    def run() -> None:
        with torch.inference_mode():
            structures[0].answer(structures[1].encoder(motion), bones)

    return run


def seconds(call: Callable[[], object]) -> tuple[float, float]:
    """Wall and processor."""
    start = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - start[0], time.process_time() - start[1]


def products(rows: int = 512) -> None:
    """What the processor can do: the best time of products of the embedding, and what else they can be.

    rows: edges that are gone through at a time.
    """
    wide, narrow = RELEASED.embedding[0], RELEASED.width
    given, edges, result = (torch.randn(rows, size) for size in (wide, 5, narrow))
    last, first = torch.randn(narrow, wide), torch.randn(wide, 4)
    across, along, side = last.T.contiguous(), torch.zeros(wide, 5), torch.zeros(5, wide)
    inward = first.T.contiguous()
    calls: dict[str, tuple[int, Callable[[], object]]] = {
        "hidden to edges": (narrow, lambda: torch.mm(given, last.T, out=result)),
        "the same, weights laid out": (narrow, lambda: torch.mm(given, across, out=result)),
        "to last weights": (narrow, lambda: torch.mm(result.T, given)),
        "to first weights, upright": (5, lambda: along.addmm_(given.T, edges, alpha=1e-9)),
        "to first weights, on their side": (5, lambda: side.addmm_(edges.T, given, alpha=1e-9)),
        "to inputs": (4, lambda: torch.mm(given, first)),
        "to inputs, on their side": (4, lambda: torch.mm(inward, given.T)),
    }
    for name, (size, call) in calls.items():
        best = min(seconds(call)[1] for _ in range(200))
        print(f"{name:32} {best * 1e6:7.0f} us {2e-9 * rows * wide * size / best:6.1f} GFLOP/s")


def gigabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def measured(name: str, options: argparse.Namespace) -> tuple[float, float]:
    """Prints what one kind of networks costs; processor seconds of an iteration, and of one long clip."""
    rounds = options.rounds
    iteration = Iteration(options.rows, plain=name == "plain")
    iteration()
    found = [seconds(iteration) for _ in range(rounds)]
    wall, processor = (statistics.median(column) for column in zip(*found, strict=True))
    print(f"{name:6}iteration {wall:7.2f} s wall {processor:7.2f} s processor {gigabytes():6.2f} GB peak")
    if options.profile:
        with profile(activities=[ProfilerActivity.CPU]) as record:
            iteration()
        print(
            record.key_averages().table(
                sort_by="self_cpu_time_total", row_limit=18, max_name_column_width=44
            )
        )
    iteration.structures.eval()
    clip = 0.0
    for clips in (1, options.clips):
        call = inference(iteration.structures, clips)
        call()
        wall, processor = map(min, zip(*(seconds(call) for _ in range(rounds)), strict=True))
        print(
            f"{name:6}{clips:3} x {LONG} frames: {clips * LONG / wall:8.0f} frames/s, "
            f"{clips * LONG / processor:.0f} per second of processor time"
        )
        clip = clip or processor
    return found[0][1], clip


def share(rank: int, processes: int, rows: int, rounds: int, meeting: str) -> None:
    """What one of several processes does."""
    torch.set_num_threads(1)
    distributed.init_process_group("gloo", init_method=meeting, rank=rank, world_size=processes)
    iteration = Iteration(rows // processes, plain=False)
    iteration()
    found = [seconds(iteration)[0] for _ in range(rounds)]
    if rank == 0:
        wall, each = statistics.median(found), f"{processes} processes of {rows // processes} rows"
        print(f"lean  iteration {wall:7.2f} s wall, {each}, {gigabytes():.2f} GB peak each")
    distributed.destroy_process_group()


def together(processes: int, rows: int, rounds: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        meeting = (Path(folder) / "meeting").as_uri()
        torch.multiprocessing.spawn(share, (processes, rows, rounds, meeting), processes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--rows", type=int, default=32)
    parser.add_argument("--clips", type=int, default=32)
    parser.add_argument("--profile", action="store_true")
    parser.add_argument("--products", action="store_true")
    parser.add_argument("--together", action="store_true")
    parser.add_argument("--only", choices=("lean", "plain"))
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    print(f"torch {torch.__version__}, {options.threads} threads, batch {options.rows}")
    if options.products:
        products()
        return
    if options.together:
        together(options.threads, options.rows, options.rounds)
        return
    kinds = (options.only,) if options.only else ("lean", "plain")
    found = [measured(kind, options) for kind in kinds]
    if len(found) == 2:
        lean, plain = found
        print(
            f"plain / lean: {plain[0] / lean[0]:.1f} x per iteration, {plain[1] / lean[1]:.1f} x per clip"
        )


if __name__ == "__main__":
    main()
