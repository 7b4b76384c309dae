"""What a training step of HuMoT costs, and how fast it answers, beside plain networks and bare products.

Run it with ``python tests/benchmarks/humot_speed.py [--design paper_count|text|small] [--threads N]
[--rounds N] [--rows N] [--full] [--profile]``, or with ``--long`` for the growth of time and memory up to
10,000 frames and 200 joints (``--only FRAMES JOINTS`` for one size; peaks are those of a whole process).

The plain networks are ``tests/methods/humot_reference.py``, with the same weights. A step is forward, loss,
backward and Adam, on chunks of 30 frames of bodies with 17 to 52 joints, joints dropped as in training:
what a batch that mixes structures is like; ``--full`` gives all rows 25 joints, nothing padded. Bare
products are the matrix products of the description, one by one and nothing else, on the tokens that are
real, with convolutions in time as products of unfolded frames; three times that for a step. Processor time
is given, because other processes move it less; all take turns, and the best round counts.
"""

from __future__ import annotations

import argparse
import itertools
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.profiler import ProfilerActivity, profile

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1] / "methods"))

from humot_reference import PlainDecoder, PlainEncoder, batch

from retarget_bench.methods.humot.network import Decoder, Encoder
from retarget_bench.methods.humot.network.tokens import RaggedTokens
from retarget_bench.methods.humot.settings import PAPER_COUNT, SMALL, TEXT, Design

DESIGNS = {"paper_count": PAPER_COUNT, "text": TEXT, "small": SMALL}
FRAMES = 30
BODIES = ((17, 12), (23, 12), (25, 12), (27, 12), (52, 12))
"""Joints of a structure, and how many of them are major ones."""
SIZES = ((30, 25), (300, 25), (3000, 25), (10_000, 25), (300, 50), (300, 100), (300, 200), (10_000, 200))


def drawn(rows: int, full: bool) -> list[int]:
    """Joints that are left of bodies in turn."""
    if full:
        return [25] * rows
    draw = torch.Generator().manual_seed(0)
    counts = []
    for row in range(rows):
        joints, major = BODIES[row % len(BODIES)]
        kept = torch.rand(major, generator=draw).gt(0.1).sum()
        others = torch.rand(joints - major, generator=draw).gt(0.5).sum()
        counts.append(int(kept + others))
    return counts


class Pair:
    """An encoder and a decoder, and their work."""

    def __init__(self, encoder: nn.Module, decoder: nn.Module, given: tuple[Tensor, ...]) -> None:
        self.encoder, self.decoder, self.given = encoder, decoder, given
        parameters = [*encoder.parameters(), *decoder.parameters()]
        self.optimiser = torch.optim.Adam(parameters, 1e-5)

    def answer(self) -> Tensor:
        positions, *where = self.given
        if isinstance(self.encoder, PlainEncoder):
            return self.decoder(self.encoder(positions, *where), *where)
        template, joints, frames = where
        given, asked = RaggedTokens.between(joints.numpy(), joints.numpy(), frames.numpy())
        return self.decoder(self.encoder(positions, template, given), template, asked)

    def step(self) -> None:
        self._train(True)
        self.optimiser.zero_grad(set_to_none=True)
        (self.answer() - self.given[0]).square().mean().backward()
        self.optimiser.step()

    @torch.no_grad()
    def infer(self) -> None:
        self._train(False)
        self.answer()

    def _train(self, training: bool) -> None:
        self.encoder.train(training)
        self.decoder.train(training)


def products(design: Design, counts: list[int]) -> Callable[[], None]:
    """All matrix products of the description, forward: ``(tokens, inputs)`` times ``(inputs, outputs)``."""
    width, kernel, half = design.width, design.kernel, design.motion[-1]
    joints, rows = sum(counts), len(counts)
    sizes: list[tuple[int, int, int]] = []
    block = [(width, 3 * width), (width, width), (width, design.expansion * width)]
    block.append((design.expansion * width, width))
    counted = list(zip((joints + rows, joints), design.blocks, strict=True))
    for tokens, blocks in counted:
        sizes += [(tokens * FRAMES, *each) for each in block] * blocks
    channels = (3, *design.motion)
    sizes += [(joints * FRAMES, kernel * one, two) for one, two in itertools.pairwise(channels)]
    sizes += [(joints * FRAMES, half, half)] * design.joined + [(joints * FRAMES, 2 * half, width)]
    sizes += [(joints * FRAMES, kernel * width, width)] * 3
    sizes += [(joints * FRAMES, width, width)] * (design.written - 1) + [(joints * FRAMES, width, 3)]
    sizes += [(rows * FRAMES, kernel * width, width)] * 3
    sizes += [(rows * FRAMES, width, width)] * (2 + 2 * design.blocks[1])
    size = width // design.heads
    heads = [(tokens * FRAMES, blocks) for tokens, blocks in counted]
    largest = max(one * two for one, two, _ in sizes)
    left, right = torch.randn(largest), torch.randn(max(two * three for _, two, three in sizes))
    out = torch.empty(max(one * three for one, _, three in sizes))

    def run() -> None:
        for one, two, three in sizes:
            view = left[: one * two].view(one, two), right[: two * three].view(two, three)
            torch.mm(*view, out=out[: one * three].view(one, three))
        for tokens, blocks in heads:
            each = left[: tokens * width].view(design.heads, tokens, size)
            for _ in range(blocks):
                small = torch.bmm(each.transpose(1, 2), each)
                torch.bmm(each, small)

    return run


def taken(work: Callable[[], None]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def compare(design: Design, rows: int, rounds: int, full: bool) -> None:
    counts = drawn(rows, full)
    given = batch(counts, [FRAMES] * rows)
    torch.manual_seed(0)
    encoder, decoder = Encoder(design), Decoder(design)
    lean = Pair(encoder, decoder, given)
    plain = Pair(PlainEncoder(encoder), PlainDecoder(decoder), given)
    with torch.no_grad():
        torch.testing.assert_close(lean.answer(), plain.answer(), atol=1e-5, rtol=1e-5)
    bare = products(design, counts)
    print(f"{rows} rows of {FRAMES} frames, {sum(counts)} joints, {rows * max(counts)} with padding")
    for name, work in (("step", (lean.step, plain.step)), ("answer", (lean.infer, plain.infer))):
        best = [float("inf")] * 3
        for _ in range(rounds + 1):
            for which, each in enumerate((*work, bare)):
                best[which] = min(best[which], taken(each))
        ours, theirs, least = best[0], best[1], best[2] * (3.0 if name == "step" else 1.0)
        print(
            f"{name:8s}{ours * 1e3:9.0f} ms   plain {theirs * 1e3:9.0f} ms   products {least * 1e3:9.0f} ms"
            f"   of plain {ours / theirs:.2f}   of products {ours / least:.2f}",
            flush=True,
        )


def profiled(design: Design, rows: int, full: bool) -> None:
    given = batch(drawn(rows, full), [FRAMES] * rows)
    pair = Pair(Encoder(design), Decoder(design), given)
    pair.step()
    with profile(activities=[ProfilerActivity.CPU]) as found:
        pair.step()
    print(found.key_averages().table(sort_by="self_cpu_time_total", row_limit=25, max_name_column_width=48))


@torch.no_grad()
def long(design: Design, frames: int, joints: int) -> None:
    torch.manual_seed(0)
    encoder, decoder = Encoder(design).eval(), Decoder(design).eval()
    given = batch([joints], [frames])
    start = time.process_time()
    decoder(encoder(*given), *given[1:])
    seconds = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    each = seconds / frames / joints * 1e6
    bare = products(design, [joints])  # of FRAMES frames; products grow with frames and nothing else
    least = min(taken(bare) for _ in range(5)) * frames / FRAMES
    print(
        f"{frames:7d} frames {joints:4d} joints {seconds:9.2f} s {each:7.2f} us a joint and frame"
        f" {peak:6.2f} GB   of products {seconds / least:.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--design", choices=DESIGNS, default="paper_count")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--rows", type=int, default=32)
    parser.add_argument("--full", action="store_true", help="25 joints in all rows")
    parser.add_argument("--profile", action="store_true", help="what a step spends its time on")
    parser.add_argument("--long", action="store_true", help="growth in frames and joints")
    parser.add_argument("--blocks", type=int, help="on both sides; peak memory of long motions stays")
    parser.add_argument("--only", type=int, nargs=2, metavar=("FRAMES", "JOINTS"))
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    design = DESIGNS[args.design]
    if args.blocks:
        design = replace(design, blocks=(args.blocks, args.blocks))
    if args.only:
        long(design, *args.only)
    elif args.long:
        for frames, joints in SIZES:
            own = [sys.executable, __file__, "--design", args.design, "--threads", str(args.threads)]
            subprocess.run([*own, "--only", str(frames), str(joints)], check=True)
    elif args.profile:
        profiled(design, args.rows, args.full)
    else:
        compare(design, args.rows, args.rounds, args.full)


if __name__ == "__main__":
    main()
