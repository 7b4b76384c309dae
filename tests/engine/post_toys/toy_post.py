"""A post-processor whose behaviour is chosen by its parameter ``does``."""

import numpy as np

from retarget_bench.plugins.post_processors import PostCard


class ToyPost:
    def __init__(self, does: str = "lift", by: float = 0.0) -> None:
        self.does, self.by = does, by
        kinds = ("positions",) if does == "picky" else ("motion",)
        self.card = PostCard(
            name="toy_post", summary="toy", version="7", accepts=kinds, stochastic=does == "noise"
        )

    def supports(self, source, target):
        return "I only know tall targets" if self.does == "refuse" and target.name != "tall" else None

    def process(self, prediction, source, *, context):
        motion = prediction
        if self.does == "look":
            assert context.ground.height == 0.0
            for name in ("reference", "second_reference", "target_motions", "other_clips"):
                assert getattr(context, name) is None
        if self.does == "raise":
            raise RuntimeError("no idea")
        if self.does == "overwrite":
            source.root[...] = 0.0
            motion.root[...] = 0.0
        if self.does == "short":
            return motion.at(slice(1, None))
        scale = 2.0 if self.does == "double" else 1.0
        shift = np.random.default_rng(context.seed).normal() if self.does == "noise" else self.by
        root = motion.root * scale + [0.0, shift, 0.0]
        return motion.character.motion(motion.rotations, root, motion.fps)


plugin = ToyPost
