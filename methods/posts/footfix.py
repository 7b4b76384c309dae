"""Holds feet where the source's feet rest: blended places, then gradient steps on the whole body."""

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.contact import CONTACT_ROLES, CONTACT_SPEED, planted, runs
from retarget_bench.motion.roles import HANDS
from retarget_bench.plugins.post_processors import Post, PostCard

CHUNK = 4096
"""Frames that are solved together: they do not depend on each other, and more would cost memory."""


class FootFix(Post):
    """The foot clean-up of SAN's and PAN's code, which they use for pictures and not for their numbers.

    A foot joint is in contact where its counterpart in the *source* moves slowly; feet and toes of both
    sides count, and fore paws where both bodies stand on four legs. Over every stretch of contact the
    joint stands at the mean of its places in the answer. ``blend`` frames before and after, it goes there
    with the weight 2u^3 - 3u^2 + 1, u = d / (blend + 1), d frames away; between two stretches that are
    close to each other, both pulls are weighted likewise by how near they are. Then Adam moves all
    rotations and the root's path towards where all joints are in those places, each frame on its own.
    Frames that no contact reaches stay as they are to the last bit.

    Ours: frames count at 30 per second whatever the rate; the root is solved for in heights, so that one
    learning rate fits every body; squared distances are summed over a frame, not averaged over the clip,
    so that a frame's answer does not depend on the clip's length; and every frame gets the best of its
    iterates. An answer known by positions gets the blended places, and bones of feet may then stretch.
    """

    card = PostCard(
        name="footfix",
        summary="Holds feet where the source's feet rest, then solves the body again to fit",
        version="1",
        paper="SAN (Aberman et al. 2020) and PAN (Hu et al. 2023): the foot clean-up of their code",
        accepts=("motion", "positions"),
        parameters={
            "limit": "a source's joint that moves less than so many heights per 1/30 s rests",
            "blend": "frames before and after a contact in which the joint goes there and back",
            "steps": "gradient steps of the solve",
            "rate": "learning rate of the solve: of quaternions, and of the root in heights",
        },
    )

    def __init__(
        self, limit: float = CONTACT_SPEED, blend: int = 6, steps: int = 50, rate: float = 1e-3
    ) -> None:
        if not (limit > 0 and rate > 0 and blend >= 0 and steps >= 0):
            raise BenchError("footfix needs limit and rate above 0, and blend and steps not below 0")
        self.limit, self.blend, self.steps, self.rate = limit, blend, steps, rate

    def supports(self, source: Character, target: Character) -> str | None:
        return None if _feet(source, target) else "no foot or toe has a counterpart in the source"

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Prediction:
        body = prediction.character
        source_feet, target_feet = np.array(_feet(source.character, body)).T
        rests = planted(source.positions[:, source_feet], source.character.height, source.fps, self.limit)
        reach = round(self.blend * source.fps / 30)
        targets = prediction.positions.copy()
        targets[:, target_feet] = held(prediction.positions[:, target_feet], rests, reach)
        touched = np.flatnonzero((near(rests, reach)[0] > 0).any(axis=(1, 2)))
        if not len(touched):
            return prediction
        if not isinstance(prediction, Motion):
            return body.positions(targets, prediction.fps)
        moved = prediction.copy()
        for first in range(0, len(touched), CHUNK):
            some = touched[first : first + CHUNK]
            moved.rotations[some], moved.root[some] = solve(
                prediction.at(some), targets[some], self.steps, self.rate, context.device
            )
        return moved


def _feet(source: Character, target: Character) -> list[tuple[int, int]]:
    """(source's joint, target's joint) of every part that both stand on."""
    paws = HANDS if source.four_legged and target.four_legged else ()
    return [
        (source.joint_of[role], target.joint_of[role])
        for role in (*CONTACT_ROLES, *paws)
        if role in source.joint_of and role in target.joint_of
    ]


# ------------------------------------------------------------------------------------------ blending
def ease(share: np.ndarray) -> np.ndarray:
    """2u^3 - 3u^2 + 1: from 1 at u = 0 to 0 at u = 1, level at both ends, and 0 beyond."""
    u = np.clip(share, 0.0, 1.0)
    return np.asarray((2.0 * u - 3.0) * u * u + 1.0)


def near(rests: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pull of the contacts before and after a frame, their distance, and their frames.

    rests: ``(frames, joints)`` bool. reach: frames beyond which a contact does not pull.
    Returns weights, distances in frames (out of reach where there is none) and frames of contact, all
    ``(frames, joints, 2)``: of the last contact up to each frame, and of the first one from it on.
    """
    count = len(rests)
    at = np.arange(count)[:, None]
    before = np.maximum.accumulate(np.where(rests, at, -1), axis=0)
    after = np.minimum.accumulate(np.where(rests, at, count)[::-1], axis=0)[::-1]
    exists = np.stack([before >= 0, after < count], axis=2)
    frames = np.where(exists, np.stack([before, after], axis=2), at[..., None])
    away = np.where(exists, np.abs(frames - at[..., None]), count + reach)
    return ease(away / (reach + 1)), away, frames


def held(places: np.ndarray, rests: np.ndarray, reach: int) -> np.ndarray:
    """Places ``(frames, joints, 3)`` with every stretch of contact at its mean, blended into the rest."""
    pinned = places.copy()
    for joint in range(places.shape[1]):
        for first, last in runs(rests[:, joint]):
            pinned[first:last, joint] = places[first:last, joint].mean(axis=0)
    weights, away, frames = near(rests, reach)
    goals = np.take_along_axis(pinned[:, :, None], frames[..., None], axis=0)
    pull = weights[..., None]
    before, after = np.moveaxis((1.0 - pull) * places[:, :, None] + pull * goals, 2, 0)
    share = ease(away[..., 0] / np.maximum(away.sum(axis=2), 1))
    share = np.where(weights[..., 1] == 0.0, 1.0, np.where(weights[..., 0] == 0.0, 0.0, share))[..., None]
    return np.asarray(share * before + (1.0 - share) * after)


# ------------------------------------------------------------------------------------------- solving
def solve(
    motion: Motion, targets: np.ndarray, steps: int, rate: float, device: str
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations and root path, from those of ``motion``, that bring its joints near targets.

    targets: ``(frames, joints, 3)`` metres. Every frame gets the best of its iterates, or its start: a
    rate that is right for centimetres makes Adam swing by millimetres about what was nearly right before.
    """
    import torch

    from retarget_bench.motion.kinematics_torch import Tree, forward

    def tensor(values: np.ndarray) -> torch.Tensor:
        return torch.tensor(values, dtype=torch.float64, device=device)

    height = motion.character.height
    tree = Tree.of(motion.skeleton).to(device)
    offsets, start, goal = tensor(motion.skeleton.offsets), tensor(motion.root), tensor(targets)
    turns = tensor(motion.rotations).requires_grad_()
    shift = torch.zeros_like(start).requires_grad_()
    adam = torch.optim.Adam([turns, shift], lr=rate)
    lowest, least = [turns.detach().clone(), start.clone()], torch.full_like(start[:, 0], torch.inf)
    for step in range(steps + 1):
        unit, root = torch.nn.functional.normalize(turns, dim=-1), start + height * shift
        places, _ = forward(tree, offsets, unit, root)
        off = ((places - goal) / height).square().sum(dim=(1, 2))
        better = off.detach() < least
        least = torch.where(better, off.detach(), least)
        for best, current in zip(lowest, (unit, root), strict=True):
            best[better] = current.detach()[better]
        if step < steps:
            adam.zero_grad()
            off.sum().backward()  # type: ignore[no-untyped-call]
            adam.step()
    rotations, path = (best.cpu().numpy() for best in lowest)
    return rotations, path


plugin = FootFix
