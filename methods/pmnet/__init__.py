"""PMnet: poses one by one and movement apart from them, retargeted by networks trained without pairs."""

from collections.abc import Mapping
from typing import ClassVar

from retarget_bench.api import MethodCard
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.kinematic.one_structure import OneStructure

from .inference import Retargeter
from .settings import PmnetConfig

DIFFERS = {
    "variant": "own form of input",
    "lengths": "in hip heights",
    "path": "path relative to the source's",
}
"""Parameter -> how its default differs from the paper."""


class Pmnet(OneStructure, Retargeter):
    """Learning of disentangled pose and movement for unsupervised retargeting (Lim et al., BMVC 2019).

    An encoder reads the places of 22 joints of a single frame; one head says how the joints of this very
    body turn, another what has to be added on the target, whose bones it is told; forward kinematics makes
    places of both. Two convolutions over time carry the movement of the hips over, in heights. It learns
    from unpaired clips: the pose has to be found again on its own body, an answer on another body has to
    look the same to the encoder, and a discriminator watches the mean of all joints.

    Bodies that lack a spine joint, the neck, a collar bone or a toe have a joint of no length in its place,
    as in ``nkn``, where ``facing``, ``yaw``, ``path``, ``clean`` and ``lengths`` are explained too.

    variant: ``released`` is the authors' code: all places are raised by the height of the hips above the
    floor in their clip's first frame, a frame has the movement to the next one, any body may be drawn as
    target, the source too, and the discriminator sees normalised numbers. ``own``: places are relative to
    the hips, a frame has the movement since the one before, a target is the source where that is meant,
    else another body, and the discriminator sees paths in heights.

    As published, with no weights shipped: ``pmnet[variant=released,lengths=world,path=integrated]``, preset
    ``paper``; docs/methods.md says what still differs.
    """

    Config = PmnetConfig
    config: PmnetConfig
    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        "paper": TrainingConfig(steps=15_000, batch=16, window=60, rate=1e-4),
        "default": TrainingConfig(
            steps=20_000,
            batch=16,
            window=60,
            rate=1e-3,
            schedule="cosine",
            warm_up=200,
            validate=500,
            average=0.999,
        ),
    }

    card = MethodCard(
        name="pmnet",
        title="PMnet",
        summary="Networks of single poses on 22 joints, and one of the movement, trained without pairs; "
        "ours: bodies that lack some of them",
        version="1",
        paper="Lim, Chang, Choi: PMnet: Learning of Disentangled Pose and Movement for Unsupervised Motion "
        "Retargeting, BMVC 2019",
        published=({"variant": "released", "lengths": "world", "path": "integrated"},),
        differs=DIFFERS,
        accepts=("motion", "positions"),
    )


plugin = Pmnet
