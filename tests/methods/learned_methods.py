"""All learned methods with small networks, and cases that each of them answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import humot_material
import nkn_toys
import npt_material
import pan_material
import r2et_material
import same_material
import san_material
import skr_material
import smrm_material
import torch
from method_bodies import SHORT, dance
from skinned_toys import scan

from retarget_bench.methods.nkn import plugin as Nkn
from retarget_bench.methods.nkn_cross import plugin as NknCross
from retarget_bench.methods.paired import Paired
from retarget_bench.methods.paired.features import RoleBody
from retarget_bench.methods.pmnet import plugin as Pmnet
from retarget_bench.methods.pmnet_cross import plugin as PmnetCross
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import presets
from retarget_bench.training.data import ClipArrays, TrainingData

Names = Sequence[tuple[str, int, str]]
"""Of each case the source's body, its number of frames, and the target's body."""


@dataclass(frozen=True)
class Learned:
    """A method for the tests of what all learned methods have in common."""

    module: Callable[[], Any]
    """A new training module; its random weights are the same each time."""
    body: Callable[[str], Character]
    names: Names
    source: Callable[[Motion], Any] = lambda motion: motion
    """What the method is given of a motion."""
    answering: Callable[[], Any] | None = None
    """A training module whose method can be asked, where that of ``module`` cannot."""
    seeds: int = 1
    """Of how many batches the gradients together reach every parameter."""
    resting: tuple[str, ...] = ()
    """Parts of names of parameters that have no gradient in any step."""
    said: Mapping[str, Any] = field(default_factory=dict)
    """Parameters that answers depend on and weights do not, where they are not the usual ones."""
    rate: float = 1e-3
    """At which a few steps on one batch lower the loss."""

    def cases(self) -> list[tuple[Any, Character]]:
        """Sources and targets, all different."""
        return [
            (self.source(dance(self.body(source), frames, seed)), self.body(target))
            for seed, (source, frames, target) in enumerate(self.names)
        ]

    def moved(self) -> Any:
        """The training module with numbers added to all weights: what begins at nothing hides the rest."""
        return moved(self.module())

    def method(self) -> Any:
        """The method with weights that are drawn, not learnt: answers that differ from frame to frame."""
        return moved((self.answering or self.module)()).method()


def moved(module: Any) -> Any:
    torch.manual_seed(1)
    with torch.no_grad():
        for each in module.modules.parameters():
            each.add_(0.03 * torch.randn_like(each))
    module.modules.eval()
    return module


def pan(
    names: Names, bodies: Sequence[str] = pan_material.TWO, seeds: int = 1, **parameters: Any
) -> Learned:
    """PAN with narrow networks, which cannot be asked."""
    return Learned(
        partial(pan_material.training_module, bodies, small=True, **parameters),
        pan_material.BODIES.__getitem__,
        names,
        answering=partial(pan_material.training_module, bodies, **parameters),
        seeds=seeds,
    )


def humot(**parameters: Any) -> Learned:
    """HuMoT likewise."""
    return Learned(
        partial(humot_material.training_module, thin=True, **parameters),
        pan_material.BODIES.__getitem__,
        HUMOT,
        answering=partial(humot_material.training_module, **parameters),
    )


def paired_training() -> Any:
    """Three bodies that do the same two clips."""
    clips = {
        name: [
            ClipArrays(name, f"clip {seed}", RoleBody(body).see(dance(body, 70, seed))) for seed in range(2)
        ]
        for name, body in same_material.BODIES.items()
    }
    torch.manual_seed(0)
    method = Paired()
    return method.training_module(TrainingData(same_material.BODIES, clips), presets(method)["quick"])


TOYS = {**nkn_toys.CAST, "short": SHORT}
DANCERS = {**smrm_material.BODIES, "short": SHORT}
PAN: Names = (("one", 40, "legs"), ("legs", 21, "tall"), ("tall", 40, "stout"), ("one", 7, "stout"))
LEGS: Names = (("one", 20, "rex"), ("rex", 15, "tall"), ("tall", 7, "one"))
KINEMATIC: Names = (("one", 40, "small"), ("long", 7, "short"), ("short", 60, "one"))
CROSS: Names = (("one", 20, "bendy"), ("bendy", 21, "one"), ("long", 7, "small"))
HUMOT: Names = (("one", 40, "stout"), ("legs", 33, "one_one_armed"), ("one_one_armed", 7, "one"))
OWN: Names = (("ada", 3, "ada"), ("ada", 2, "ada"))
SKINNED: Names = (("one", 3, "tall"), ("tall", 2, "spined"))
LEARNED: Mapping[str, Learned] = {
    "pan": pan((*PAN, ("tall", 12, "one_one_armed")), pan_material.THREE, seeds=6),
    "pan[variant=released]": pan(PAN, variant="released"),
    "pan[variant=paper]": pan(PAN, variant="paper"),
    "pan[parts=three]": replace(pan(LEGS, pan_material.LEGS, parts="three"), said={"path": "relative"}),
    "san": Learned(
        san_material.training_module, pan_material.BODIES.__getitem__, PAN, resting=("skeleton.layers.1.",)
    ),
    "san[variant=released]": Learned(
        lambda: san_material.training_module(variant="released", heights="learnt"),
        pan_material.BODIES.__getitem__,
        PAN,
        resting=("skeleton.layers.1.",),
    ),
    "nkn": Learned(
        lambda: nkn_toys.training_module(Nkn(hidden=16, facing=3.0), window=8),
        TOYS.__getitem__,
        KINEMATIC,
    ),
    "nkn[variant=released]": Learned(
        lambda: nkn_toys.training_module(Nkn(**{"hidden": 16, **Nkn.card.published[0]}), window=8),
        TOYS.__getitem__,
        KINEMATIC,
    ),
    "nkn_cross": Learned(
        lambda: nkn_toys.training_module(NknCross(hidden=12, facing=3.0), 6, cast=nkn_toys.STRUCTURES),
        nkn_toys.STRUCTURES.__getitem__,
        CROSS,
        seeds=6,
    ),
    "pmnet": Learned(
        lambda: nkn_toys.training_module(Pmnet(hidden=24, facing=3.0)),
        TOYS.__getitem__,
        KINEMATIC,
    ),
    "pmnet[variant=released]": Learned(
        lambda: nkn_toys.training_module(Pmnet(**{"hidden": 24, **Pmnet.card.published[0]})),
        TOYS.__getitem__,
        KINEMATIC,
    ),
    "pmnet_cross": Learned(
        lambda: nkn_toys.training_module(PmnetCross(hidden=12, facing=3.0), 8, cast=nkn_toys.STRUCTURES),
        nkn_toys.STRUCTURES.__getitem__,
        CROSS,
        seeds=6,
    ),
    "smrm": Learned(
        lambda: smrm_material.training_module(window=6, adversarial=0.1, same=0.3),
        DANCERS.__getitem__,
        (("one", 60, "legs"), ("legs", 7, "short"), ("short", 20, "tall")),
    ),
    "r2et": Learned(
        lambda: r2et_material.training_module(window=8),
        r2et_material.BODIES.__getitem__,
        (("one", 40, "tall"), ("short", 7, "legs"), ("legs", 12, "short")),
    ),
    "humot": humot(),
    "humot[variant=text]": humot(variant="text"),
    "same": Learned(
        same_material.training_module,
        same_material.BODIES.__getitem__,
        (("plain", 30, "small"), ("toeless", 11, "plain"), ("small", 7, "toeless")),
    ),
    "skr": Learned(skr_material.skr_training, skr_material.body, OWN),
    "skr[network=table5]": Learned(
        partial(skr_material.skr_training, network="table5"), skr_material.body, OWN
    ),
    "skin": Learned(skr_material.skin_training, skr_material.body, OWN, rate=1e-4),
    "skin[inputs=vectors]": Learned(
        partial(skr_material.skin_training, inputs="vectors"), skr_material.body, OWN, rate=1e-4
    ),
    "npt": Learned(
        npt_material.training_module, npt_material.BODIES.__getitem__, SKINNED, scan, resting=(".bias",)
    ),
    "paired": Learned(
        paired_training,
        same_material.BODIES.__getitem__,
        (("plain", 40, "small"), ("toeless", 7, "plain"), ("small", 12, "toeless")),
    ),
}
"""By name, with what is particular to a variant in brackets."""
