"""Forward kinematics against upc-pymotion and pytorch_kinematics: times and ratios in one run.

    python benchmarks/kinematics.py [--threads 1] [--repeats 15]

Every contender computes the same 24-joint body from the same random poses; their positions are compared
before anything is timed. In every repeat all contenders take turns, and a ratio is the median over repeats
of two times from the same repeat, so that other work on the machine slows all of them alike. On one thread
processor time is counted, which other processes move less than the clock.
pytorch_kinematics has no ball joints: it gets three hinges per joint (the same body), and once more only
one hinge per joint, an easier question than the others answer. backward is the gradient of a weighted sum
of all positions in the pose and, where the contender offers it, in the root's place.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
import pytorch_kinematics as pk
import torch
from pymotion.ops import skeleton_np as pymotion_numpy
from pymotion.ops import skeleton_torch as pymotion_torch

from retarget_bench.motion import kinematics, kinematics_torch, rotation
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.card import hardware

PARENTS = (-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 3, 10, 11, 12, 0, 14, 15, 16, 0, 18, 19, 20, 17, 21)
SIZES = ((1, 1), (1, 64), (256, 64))
"""(sequences, frames)."""
OWN = "retarget_bench"

Call = Callable[[], "np.ndarray | torch.Tensor"]
"""Does the work once and returns positions ``(..., joints, 3)``, or the gradient in the angles."""


# ------------------------------------------------------------------------------------------ contenders
def body(seed: int = 0, joints: int = len(PARENTS)) -> Skeleton:
    offsets = np.random.default_rng(seed).normal(size=(joints, 3)) * 0.2
    return Skeleton(tuple(f"joint{k}" for k in range(joints)), np.array(PARENTS[:joints]), offsets)


def hinges(skeleton: Skeleton, axes: str, device: str) -> pk.chain.Chain:
    """One frame per hinge; the first hinge of a joint carries the joint's offset."""
    first: list[pk.frame.Frame] = []
    last: list[pk.frame.Frame] = []
    for joint, parent in enumerate(skeleton.parents.tolist()):
        above = last[parent] if parent >= 0 else None
        for k, letter in enumerate(axes):
            offset = skeleton.offsets[joint] if k == 0 and parent >= 0 else np.zeros(3)
            hinge = pk.frame.Joint(
                f"{joint}{letter}_hinge",
                offset=pk.Transform3d(pos=torch.tensor(offset, dtype=torch.float32)),
                joint_type="revolute",
                axis=[float(letter == each) for each in "XYZ"],
            )
            frame = pk.frame.Frame(f"{joint}{letter}", joint=hinge)
            (above.children if above is not None else first).append(frame)
            above = frame
        last.append(above)
    return pk.chain.Chain(first[0]).to(device=device)


def poses(sequences: int, frames: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Euler angles XYZ ``(s, f, joints, 3)``, the same as quaternions, and root places."""
    generator = np.random.default_rng(1)
    angles = generator.uniform(-2, 2, size=(sequences, frames, len(PARENTS), 3))
    angles[..., 1] /= 2
    return angles, rotation.from_euler(angles, "XYZ"), generator.normal(size=(sequences, frames, 3))


def numpy_contenders(skeleton: Skeleton, sequences: int, frames: int) -> dict[str, Call]:
    _, turned, root = poses(sequences, frames)
    offsets, parents = skeleton.offsets, skeleton.parents
    return {
        OWN: lambda: kinematics.forward(skeleton, turned, root)[0],
        "pymotion fk": lambda: pymotion_numpy.fk(turned, root, offsets, parents)[0],
        "pymotion fk_quat": lambda: pymotion_numpy.fk_quat(turned, root, offsets, parents)[0],
    }


def torch_contenders(
    skeleton: Skeleton, sequences: int, frames: int, device: str, backward: bool
) -> dict[str, Call]:
    angles, turned, root = (
        torch.tensor(each, dtype=torch.float32, device=device) for each in poses(sequences, frames)
    )
    weight = torch.randn(sequences, frames, len(skeleton), 3, device=device)
    offsets = torch.tensor(skeleton.offsets, dtype=torch.float32, device=device)
    tree = kinematics_torch.Tree.of(skeleton).to(device)
    ball, single = hinges(skeleton, "XYZ", device), hinges(skeleton, "X", device)
    at = {
        chain: [chain.frame_to_idx[f"{joint}X"] for joint in range(len(skeleton))]
        for chain in (ball, single)
    }

    def hinged(chain: pk.chain.Chain, theta: torch.Tensor, root: torch.Tensor) -> torch.Tensor:
        moved = chain.forward_kinematics_tensor(theta)[at[chain], :, :3, 3]
        return moved.permute(1, 0, 2).view(sequences, frames, -1, 3) + root[:, :, None]

    order = {chain: theta_order(chain) for chain in (ball, single)}
    theta = angles.flatten(2).flatten(0, 1)[:, order[ball]]
    easy = angles[..., 0].flatten(0, 1)[:, order[single]]
    calls: dict[str, tuple[Callable[..., torch.Tensor], torch.Tensor]] = {
        OWN: (lambda q, p: kinematics_torch.forward(tree, offsets, q, p)[0], turned),
        "pymotion fk": (lambda q, p: pymotion_torch.fk(q, p, offsets, skeleton.parents)[0], turned),
        "pymotion fk_quat": (
            lambda q, p: pymotion_torch.fk_quat(q, p, offsets, skeleton.parents)[0],
            turned,
        ),
        "pytorch_kinematics, 3 hinges a joint": (lambda t, p: hinged(ball, t, p), theta),
        "pytorch_kinematics, 1 hinge a joint": (lambda t, p: hinged(single, t, p), easy),
    }
    return {name: timed_call(call, pose, root, weight, backward) for name, (call, pose) in calls.items()}


def theta_order(chain: pk.chain.Chain) -> list[int]:
    """For every parameter of the chain, its place in angles ``(joints * hinges)``."""
    names = chain.get_joint_parameter_names()
    axes = sorted({name.rstrip("_hinge")[-1] for name in names})
    return [int(name[: -len("X_hinge")]) * len(axes) + axes.index(name[-len("X_hinge")]) for name in names]


def timed_call(
    call: Callable[..., torch.Tensor],
    pose: torch.Tensor,
    root: torch.Tensor,
    weight: torch.Tensor,
    backward: bool,
) -> Call:
    if not backward:
        return lambda: call(pose, root)
    leaves = pose.clone().requires_grad_(), root.clone().requires_grad_()

    def work() -> torch.Tensor:
        positions = call(*leaves)
        torch.autograd.grad(positions, leaves, weight)
        return positions.detach()

    return work


# -------------------------------------------------------------------------------------------- measuring
def agree(contenders: dict[str, Call], tolerance: float = 1e-5) -> float:
    """The largest difference to our positions in metres; contenders with an easier question excepted."""
    own = torch.as_tensor(contenders[OWN]())
    worst = 0.0
    for name, call in contenders.items():
        if "1 hinge" not in name:
            worst = max(worst, (torch.as_tensor(call()) - own).abs().max().item())
    if not worst < tolerance:
        raise SystemExit(f"contenders disagree by {worst:g} m")
    return worst


def measure(contenders: dict[str, Call], repeats: int, device: str) -> dict[str, list[float]]:
    """Seconds per call, one entry per repeat, all contenders taking turns."""

    alone = device == "cpu" and torch.get_num_threads() == 1
    clock = time.process_time if alone else time.perf_counter

    def once(call: Call, loops: int) -> float:
        start = clock()
        for _ in range(loops):
            call()
        if device != "cpu":
            torch.cuda.synchronize()
        return (clock() - start) / loops

    costs = {name: min(once(call, 1) for _ in range(3)) for name, call in contenders.items()}
    # turns so short that most run undisturbed, and of several calls: the first finds others' data in caches
    loops = {name: max(1, int(0.004 / cost)) for name, cost in costs.items()}
    turn = sum(loops[name] * cost for name, cost in costs.items())
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(max(repeats, int(4.0 / turn))):
        for name, call in contenders.items():
            times[name].append(once(call, loops[name]))
    return times


def report(title: str, times: dict[str, list[float]], worst: float) -> None:
    print(f"\n{title}   (positions agree to {worst:.1e} m)")
    ratios = {}
    for name, each in times.items():
        ratios[name] = statistics.median(a / b for a, b in zip(each, times[OWN], strict=True))
        print(f"  {name:38}{statistics.median(each) * 1e6:12.0f} us  {ratios[name]:8.2f} x ours")
    del ratios[OWN]
    fastest = min(ratios, key=ratios.__getitem__)
    verdict = "at least as fast" if ratios[fastest] >= 1 else "SLOWER"
    print(f"  fastest peer: {fastest}, {ratios[fastest]:.2f} x our time: ours is {verdict}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--device", default="cpu")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    packages = ("numpy", "torch", "upc-pymotion", "pytorch_kinematics")
    print(", ".join(f"{name} {version(name)}" for name in packages), f"Python {platform.python_version()}")
    print(f"{hardware(torch.device(options.device))}, load {os.getloadavg()[0]:.1f}")
    print(f"medians of {options.repeats} repeats or more")
    skeleton = body()
    for sequences, frames in SIZES:
        size = f"{sequences} x {frames} frames x {len(PARENTS)} joints"
        if options.device == "cpu":
            contest = numpy_contenders(skeleton, sequences, frames)
            report(f"numpy forward, {size}", measure(contest, options.repeats, "cpu"), agree(contest))
        for backward in (False, True):
            what = "forward + backward" if backward else "forward"
            contest = torch_contenders(skeleton, sequences, frames, options.device, backward)
            worst = agree(contest)
            report(f"torch {what}, {size}", measure(contest, options.repeats, options.device), worst)


if __name__ == "__main__":
    main()
