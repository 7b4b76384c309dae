"""HuMoT's parameters beside its variant and weights."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, TypedDict

from retarget_bench.errors import BenchError
from retarget_bench.motion import root_rules


class Overrides(TypedDict, total=False):
    """Parameters of HuMoT; defaults stand behind the types."""

    subsampling: Annotated[bool, True]
    consistency: Annotated[float, 0.5]
    facing: Annotated[bool, True]
    sized: Annotated[bool, True]
    varied: Annotated[bool, True]
    turned: Annotated[bool, False]
    mirrored: Annotated[bool, True]
    hop: Annotated[int, 6]
    split: Annotated[Literal["clip", "chunk"], "clip"]
    root_rule: Annotated[root_rules.ScalingRule, "hip_height"]
    windows: Annotated[Literal["overlapping", "whole"], "overlapping"]


PARAMETERS = {
    "variant": "small, text (the appendix by the letter) or paper_count (2,475,511 parameters)",
    "subsampling": "false: without stochastic joint subsampling (no SJS)",
    "consistency": "weight of the consistency of bone lengths (0: no BLC)",
    "facing": "windows go through the networks turned ahead (false: as the paper)",
    "sized": "bodies go through the networks in one size (false: as the paper)",
    "varied": "training has bodies of other proportions, too, and limbs held otherwise",
    "turned": "training windows are turned about the vertical axis at random",
    "mirrored": "every other training window is mirrored",
    "hop": "frames between the starts of training windows",
    "split": "chunk: a tenth of every training clip's windows is kept aside, as in the paper",
    "root_rule": "length whose ratio scales the path of the hips",
    "windows": "overlapping windows of 30 frames, or whole clips",
    "weights": "name of shipped weights, or a path to others",
}
"""A line on each parameter, for the method's card."""


@dataclass(frozen=True)
class Settings:
    """The parameters that weights depend on, by their names; see ``HuMoT``.

    Raises BenchError where a number is out of range.
    """

    subsampling: bool
    consistency: float
    facing: bool
    sized: bool
    varied: bool
    turned: bool
    mirrored: bool
    hop: int
    split: Literal["clip", "chunk"]

    def __post_init__(self) -> None:
        if not 0.0 <= self.consistency < math.inf:
            raise BenchError("humot: consistency is a weight, zero or more")
        if self.hop < 1:
            raise BenchError("humot: hop is a number of frames, one or more")
