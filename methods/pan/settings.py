"""PAN's parameters, and the networks, features and losses that its variants (``variants.toml``) choose."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, Self

from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training import variants
from retarget_bench.training.layers.skeletal.features import Features, Lengths, Path, Root, Yaw
from retarget_bench.training.layers.skeletal.layout import Slots

DecoderKind = Literal["full", "parts"]
Mask = Literal["paper", "released"]
Variant = Literal["own", "released", "paper"]
Statistics = Literal["structure", "character"]


@dataclass(frozen=True)
class PanConfig:
    """Parameters of PAN; the variant decides those that are None."""

    variant: Variant = "own"
    """own, released (as the authors' code), paper (as written)"""
    parts: str = "six"
    """six, three (legs, spine, head), or a .toml file of part = [body parts]"""
    path: Path | None = None
    """of the root: decoded, relative (to the source's; what differs fades), steady (what differs for long
    adds nothing) or carried (the source's plus what is decoded)"""
    tips: Literal["copied", "rest"] = "copied"
    """ends of chains: copied or rest"""
    target_stats: Literal["transferred", "own"] = "transferred"
    """by character: transferred, or own (of the target's reference motions: privileged)"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others, also to the authors' folder"""
    root: Root | None = None
    """the root's channels: velocity, height (velocity, but height), position"""
    lengths: Lengths | None = None
    """world (centimetres) or body (hip heights)"""
    facing: float | None = None
    """frames over which the direction faced is averaged"""
    yaw: Yaw | None = None
    """source (faces where it does) or predicted"""
    statistics: Statistics | None = None
    """mean and deviation by structure or by character"""
    conv_mask: Mask | None = None
    """of convolutions: paper, or released (shifted by one edge)"""
    decoder: DecoderKind | None = None
    """full, or parts (each edge from its own parts)"""
    dropout: float | None = None
    """share"""
    attention: bool = True
    """false: an MLP in its place (Table 5)"""
    by_part: bool = True
    """false: one token for the whole body (Table 5)"""
    kinematic: float | None = None
    """weight of joint positions, eq. 13"""
    cycle: float | None = None
    """weight of the distance of codes, eq. 11"""
    ends: float | None = None
    """weight of end effectors' movement"""
    adversarial: float | None = None
    """weight of eq. 12"""
    velocity: float | None = None
    """weight of eq. 20"""


DIFFERS: Mapping[str, Mapping[str, str]] = {
    "six": {
        "variant": "released networks",
        "conv_mask": "masks as written",
        "dropout": "no dropout",
        "lengths": "in hip heights",
        "root": "height as a feature",
        "path": "the source's path and direction",
        "statistics": "statistics by structure",
        "kinematic": "other losses",
    },
    "three": {
        "variant": "released networks on edges",
        "lengths": "in hip heights",
        "root": "height as a feature",
        "path": "path relative to the source's",
        "kinematic": "other losses",
    },
}
"""Parts -> parameter -> how ``own`` differs from what is published."""

FIELDS: Mapping[str, tuple[str, ...]] = {
    "features": ("root", "lengths", "facing", "path"),
    "design": ("conv_mask", "decoder", "dropout", "attention", "by_part"),
    "weights": ("kinematic", "cycle", "ends", "adversarial", "velocity"),
    "": ("yaw", "statistics"),
}
"""The parameters that are fields of each part of ``Settings`` ("": of the settings themselves)."""


@dataclass(frozen=True)
class Design:
    """Sizes and features of the networks.

    embedding:   hidden widths of the MLP on the four numbers of an edge (eq. 1).
    scaled:      its result is multiplied by the root of ``width`` before the code of the edge's index
                 (eq. 2, 3) is added.
    width:       numbers of an edge, a part's token and a part's code.
    layers:      layers of attention. heads: of each. feedforward: hidden width of the block behind each
                 attention, with residuals and layer norms behind both (0: eq. 4 and 5 and nothing else).
    dropout:     share, of embeddings, attention weights and both blocks.
    slots:       what the networks see: ``edges``, or ``joints`` (see ``layout.py``).
    mutual:      edges attend to the tokens of their parts too (the symmetric mask of eq. 5); else nobody
                 attends to a token but itself.
    root_alone:  the edges of every part attend to each other alone: of edges, the root's to itself.
    interleaved: the second layer of attention follows the first convolution, which halves the frames; the
                 edges are halved with it, two frames averaged. Else all layers come first.
    leak:        slope of the rectifiers below zero.
    raw:         the first convolution has a second one beside it, from the edges themselves.
    kernel:      taps of all convolutions in time.
    skeleton:    hidden width per part of the MLP on bones (eq. 7). skeleton_bent: its last layer is
                 rectified too. skeleton_share: what its code is multiplied by before it is added.
    bone_mask:   ``released`` reads other bones than a part's, as the code does by mistake (``seen_bones``).
    root_bone:   of ``released``: the bone of the root is read too, by the part of the first edge. It is
                 zero but with the authors' weights, so ours have no weights for it.
    decoder:     ``full`` reads all parts for every edge (eq. 8); ``parts``: those that the edge is of.
    padded:      the root has three channels, and the fourth stays zero: set where ``root=position``.
    conv_mask:   ``released`` shifts the parts of all convolutions by one edge, as the code does by mistake.
    attention:   False: an MLP in its place (Table 5). by_part: False: one token for the whole body, nothing
                 masked, ordinary convolutions (Table 5).
    judging:     width of the discriminator's first layer. squashed: it ends in a sigmoid (eq. 9).
    """

    embedding: tuple[int, ...] = (256, 256)
    scaled: bool = False
    width: int = 32
    layers: int = 2
    heads: int = 1
    feedforward: int = 0
    dropout: float = 0.0
    slots: Slots = "edges"
    mutual: bool = True
    root_alone: bool = False
    interleaved: bool = True
    leak: float = 0.0
    raw: bool = False
    kernel: int = 15
    skeleton: int = 64
    skeleton_bent: bool = False
    skeleton_share: float = 1.0
    bone_mask: Mask = "paper"
    root_bone: bool = False
    decoder: DecoderKind = "full"
    padded: bool = False
    conv_mask: Mask = "paper"
    attention: bool = True
    by_part: bool = True
    judging: int = 256
    squashed: bool = True


@dataclass(frozen=True)
class Weights:
    """Weights of the loss terms, each a mean over everything, and their forms.

    summed:   terms are added up over structures and pairs of them; else they are means over these.
    across:   answers, and so cycles, are of other structures alone, where there are any.
    edges:    squared error of the reconstruction in normalised edge channels (eq. 10); where
              ``rotations``, in plain rotations alone. moves: once more in the root's normalised channels.
    kinematic: of the reconstruction's joints (eq. 13), in heights or in the unit of ``Features``
              (``lengths``). positions: ``world``; ``local``, relative to the root, and the root in the
              world; or ``summed``, as seen from where the body faces, plus the sum of what it moved.
              end_sites: ends of last bones are joints here. root: the error of the root once more.
    cycle:    distance of the codes of source and answer (eq. 11), ``measure`` l1 or squared.
    again:    squared error of the cycle in normalised edge channels (eq. 11). again_positions: of its
              joints (eq. 13).
    ends:     squared difference of how end effectors move in source and answer. resting: its second term
              is a mean over those that rest, zero where none does; else over all.
    adversarial: least squares (eq. 12). discriminator_input: edge channels, bones as vectors in heights and
              the root's channels (``bones``) or both in the unit of ``Features`` (``units``), or joint
              positions. replay: discriminators see older answers too.
    velocity: squared difference of rescaled velocities of the hips (eq. 20); turns: and of how fast bodies
              turn.
    """

    summed: bool = False
    across: bool = False

    edges: float = 1.0
    rotations: bool = False
    moves: float = 0.0
    kinematic: float = 100.0
    lengths: Literal["heights", "units"] = "heights"
    positions: Literal["world", "local", "summed"] = "world"
    end_sites: bool = False
    root: float = 0.0
    cycle: float = 2.5
    measure: Literal["l1", "l2"] = "l2"
    again: float = 2.5
    again_positions: float = 100.0
    ends: float = 0.0
    resting: bool = False
    adversarial: float = 1.0
    discriminator_input: Literal["motion", "bones", "units", "positions"] = "motion"
    replay: bool = False
    velocity: float = 0.0
    turns: bool = True


@dataclass(frozen=True)
class Settings:
    """All settings of a variant.

    statistics: whether eq. 15 takes mean and deviation by structure or by character; deviations are
    ``least_deviation`` or more. reversed_: training windows run backwards half of the time. shared:
    structures have the same initial weights for what they have in common. rerooted: trees begin where the
    legs do (see ``tree.py``).
    """

    features: Features
    statistics: Statistics
    yaw: Yaw
    design: Design = Design()
    weights: Weights = Weights()
    least_deviation: float = 0.0
    reversed_: bool = False
    shared: bool = False
    rerooted: bool = False

    def overridden(self, config: PanConfig) -> Self:
        """With the parameters that are given. Raises BenchError where a number is out of range, or fields
        do not go together."""
        values = {name: getattr(config, name) for names in FIELDS.values() for name in names}
        chosen = {name: value for name, value in values.items() if value is not None}
        if not all(0.0 <= chosen.get(name, 0.0) < math.inf for name in ("facing", *FIELDS["weights"])):
            raise BenchError("weights and facing of pan are finite numbers, zero or more")
        parts = {part: {k: chosen[k] for k in names if k in chosen} for part, names in FIELDS.items()}
        if "kinematic" in chosen:  # the other weights of eq. 13 stay in proportion
            share = chosen["kinematic"] / self.weights.kinematic
            again = share * self.weights.again_positions
            parts["weights"] |= {"root": share * self.weights.root, "again_positions": again}
        features = replace(self.features, **parts["features"])
        if self.weights.positions == "summed" and features.root != "velocity":
            parts["weights"]["positions"] = "world"
        settings = replace(
            self,
            features=features,
            design=replace(self.design, **parts["design"], padded=features.root == "position"),
            weights=replace(self.weights, **parts["weights"]),
            **parts[""],
        )
        if not 0.0 <= settings.design.dropout < 1.0:
            raise BenchError("dropout of pan is a share below 1")
        if settings.design.slots == "joints" and settings.design.conv_mask == "released":
            raise BenchError("conv_mask=released is a mistake about edges, and these networks see joints")
        if settings.weights.velocity and settings.features.root == "position":
            raise BenchError(
                "eq. 20 (velocity) is about how hips move, and root=position lacks that; "
                "use root=velocity or root=height"
            )
        return settings

    def values(self) -> dict[str, Scalar]:
        """The parameters that weights depend on, by their names."""
        values = {
            name: getattr(getattr(self, part) if part else self, name)
            for part, names in FIELDS.items()
            for name in names
        }
        if values["path"] in ("relative", "steady"):  # networks learn the same
            values["path"] = "decoded"
        return values


VARIANTS = variants.beside(__file__, Settings)
"""By name; with three parts their names end in ``_three``."""
