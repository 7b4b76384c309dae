"""Frames a second of the correspondence-free pipeline online, on one core, and each stage's share.

Run it with ``python benchmarks/correspondence_free_online.py [--points 2048] [--frames 60] [--views
4]``. Every frame comes alone: its points to joints (SKR), joints to the target's rotations (SMRM with its
states), and the target's vertices, about 2,000, moved by the weights that SKIN gave them. Weights have no
part in how long it takes: where a stage has none that are shipped, random ones stand in. Processor time
is counted, which other processes on the machine move less than the clock. Most of it are two layers of SKR
that every point goes through: the last line says how long they take at the speed of a product of matrices
of their size.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from retarget_bench.methods.correspondence_free.online import Networks, OnlineRetargeter
from retarget_bench.methods.skin import SKIN
from retarget_bench.methods.skin.network import SkinningPredictor
from retarget_bench.methods.skr import SKR
from retarget_bench.methods.skr.inference import LEAST
from retarget_bench.methods.skr.network import DEEP, WIDE, SkeletonRegressor
from retarget_bench.methods.smrm import SMRM
from retarget_bench.motion.surface_sampling import sampled
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.card import hardware
from retarget_bench.training.layers import exported


def networks(views: int) -> Networks:
    torch.manual_seed(0)
    skr, skin = SKR(views=views), SKIN()
    skr = skr.using(exported(SkeletonRegressor())) if skr.untrained else skr
    skin = skin.using(exported(SkinningPredictor())) if skin.weights_card is None else skin
    return Networks(skr, SMRM(), skin)


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    start = time.process_time()
    answer = call()
    return time.process_time() - start, answer


def products(points: int, views: int) -> str:
    """What the layers from points' numbers to the maximum cost a frame, by products of their size alone."""
    views = views if points >= views * LEAST else 1
    seen, weight = torch.rand(points // views, 2 * WIDE), torch.rand(DEEP, 2 * WIDE)
    fastest = min(timed(lambda: seen @ weight.t())[0] for _ in range(200))
    operations = 2 * seen.shape[0] * weight.numel()
    return (
        f"of SKR {2e-9 * views * operations:.2f} GFLOP at {1e-9 * operations / fastest:.0f} GFLOP/s: "
        f"{2e3 * views * fastest:.2f} ms a frame"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=2048)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--views", type=int, default=4, help="of SKR: 1, 2 or 4")
    options = parser.parse_args()
    torch.set_num_threads(1)
    data: Any = registry.create("datasets", Spec.parse("puppets"))
    motion = next(iter(data.training()["body22"].values()))[0]
    motion = motion.at(np.arange(options.frames) % motion.frames)
    numbers = np.random.default_rng(0).random((motion.frames, 3, options.points))
    mesh = motion.character.mesh
    points = sampled(mesh.skinned(motion), mesh.faces, numbers)
    stages = networks(options.views)
    once, online = timed(lambda: OnlineRetargeter(stages, mesh.vertices, mesh.faces))
    online.frame(points[0])
    times: dict[str, list[float]] = {"SKR": [], "SMRM": [], "skinning": []}
    for each in points:
        seconds, joints = timed(lambda each=each: stages.skr.joints([each]))
        times["SKR"].append(seconds)
        seconds, moved = timed(lambda joints=joints: online.motion(joints))
        times["SMRM"].append(seconds)
        times["skinning"].append(timed(lambda moved=moved: online.mesh.skinned(moved))[0])
    total = sum(statistics.median(each) for each in times.values())
    print(f"{options.points} points to {len(mesh.vertices)} vertices, torch {torch.__version__}")
    print(f"one core of {hardware(torch.device('cpu'))}, load {os.getloadavg()[0]:.1f}")
    for name, each in times.items():
        median = statistics.median(each)
        print(f"{name:10}{1e3 * median:8.2f} ms a frame{100 * median / total:6.0f} %")
    print(f"{'whole':10}{1e3 * total:8.2f} ms a frame: {1 / total:.0f} frames a second")
    print(f"once for a target (joints and weights): {once:.2f} s")
    print(products(options.points, options.views))


if __name__ == "__main__":
    main()
