"""NKN: a recurrent network that sees the source's joints and turns the target's, trained without pairs."""

from collections.abc import Mapping
from typing import ClassVar

from retarget_bench.api import MethodCard
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.kinematic.one_structure import OneStructure

from .inference import Retargeter
from .settings import NknConfig

DIFFERS = {
    "variant": "own form of input and losses",
    "lengths": "in hip heights",
    "drift": "loss on displacement",
    "path": "path relative to the source's",
}
"""Parameter -> how its default differs from the paper."""


class Nkn(OneStructure, Retargeter):
    """Neural kinematic networks for unsupervised motion retargetting (Villegas et al., CVPR 2018).

    An encoder reads the places of 22 joints as seen from where the body faces; a decoder, told the bones of
    the target and what it answered the frame before, says how its joints turn and how it moves; forward
    kinematics makes places of that. It learns from unpaired clips: there and back again must give the
    source, and a discriminator watches how the answer moves.

    The paper's networks know one set of joints. Ours also answer for bodies that lack a spine joint, the
    neck, a collar bone or a toe: in its place they see a joint of no length, which does not turn. Shipped
    weights have not been trained on such bodies.

    cell: ``tf`` is the GRU of the published code and its parameter counts.
    losses: ``adversarial`` is the paper's method, ``cycle`` and ``autoencoder`` its ablations.
    variant: ``released`` is the authors' code. All places are raised by the height of the hips above the
    floor in their clip's first frame, so that the row of the hips is constant. A frame has the movement to
    the next one. The terms of rows whose target is the source are means over these rows, and the hips may
    twist. Any body may be drawn as target, the source too, and the discriminator learns from all rows.
    ``own``: the row of the hips is how far they have risen, and a frame has the movement since the one
    before. All terms are divided by all frames, and the hips count as twisted too. A target is the source
    where that is meant, else another body, and the discriminator learns from rows of the latter.
    drift: a term of our own, squared differences of movements summed up over time; the paper has none (0),
    and its path drifts until training has been long.
    facing: an answer depends on three times as many frames to come.
    yaw: ``predicted`` integrates the decoder's turns, as the paper does; ``source`` takes the source's own.
    path: ``integrated`` sums up the decoder's movements, as the paper does. ``relative``, our own, takes
    the source's path, scaled, and its turns; what the decoder's movements differ by is summed up and fades
    within ``root_rules.MEMORY``, so that no error grows with time.
    lengths: ``world`` counts in centimetres, as the paper; ``body`` in a unit that grows with the body, in
    which a movement that is copied is one that is scaled. In centimetres nothing but the discriminator says
    how far a smaller body should go, since a path that is copied as it is comes back as it was.

    As published, with no weights shipped: ``nkn[variant=released,drift=0,lengths=world,path=integrated]``,
    preset ``paper``; docs/methods.md says what still differs.
    """

    Config = NknConfig
    config: NknConfig
    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        "paper": TrainingConfig(steps=50_000, batch=16, window=60, rate=1e-4),
        "default": TrainingConfig(
            steps=6_000,
            batch=16,
            window=60,
            rate=5e-4,
            schedule="cosine",
            warm_up=200,
            validate=200,
            average=0.999,
        ),
    }

    card = MethodCard(
        name="nkn",
        title="NKN",
        summary="Recurrent encoder and decoder on 22 joints, trained without pairs; ours: bodies that lack "
        "some of them",
        version="1",
        paper="Villegas, Yang, Ceylan, Lee: Neural Kinematic Networks for Unsupervised Motion "
        "Retargetting, CVPR 2018",
        published=({"variant": "released", "drift": 0.0, "lengths": "world", "path": "integrated"},),
        differs=DIFFERS,
        accepts=("motion", "positions"),
    )


plugin = Nkn
