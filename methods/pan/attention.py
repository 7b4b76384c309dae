"""What PAN attends to (section 6.2.2): the weights of its first layer, by joint of the source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from retarget_bench.errors import NotSupported
from retarget_bench.motion import rates
from retarget_bench.motion.motion import Motion

from .body import Body
from .inference import PIECE
from .network.plan import body_parts

if TYPE_CHECKING:
    from . import Pan

WHOLE = ("whole body",)


def attended(method: Pan, source: Motion) -> dict[str, Any]:
    """What ``retarget_bench.evaluation.attention.Attention`` has, of a source that the method supports.

    The weight of a slot is that of the joint that it leads to; the weight of the root's slot is that of the
    hips. Weights of slots that lead to no joint of this body belong to none.
    Raises NotSupported where the networks have no attention.
    """
    seat, settings = method.seat(source.character), method.settings
    structure, body = method.structures[seat.structure], seat.taken
    if not settings.design.attention:
        raise NotSupported("pan[attention=false] has an MLP in the place of attention, and no weights")
    shown = rates.at_thirty(source)
    assert isinstance(shown, Motion)
    seen = torch.from_numpy(settings.form.see(shown, body)["slots"].astype(np.float32))
    (row,) = structure.which([source.character.name])
    slots = structure.normalised(seen.unsqueeze(0), torch.tensor([row]))
    with torch.inference_mode():
        found = [structure.encoder.attention(piece)[0].numpy() for piece in torch.split(slots, PIECE, 1)]
    order, joints = _joints(body)
    parts = body_parts(body.layout, settings.design)
    sees = np.array([[slot in part for slot in order] for part in parts])
    kept = sees.any(axis=0)
    low, share = rates.between(source.frames, source.fps, rates.FPS, shown.frames)
    weights = rates.straight(np.concatenate(found)[:, :, order], low, share)
    return {
        "parts": body.layout.names if settings.design.by_part else WHOLE,
        "joints": np.array(joints)[kept],
        "sees": sees[:, kept],
        "weights": weights[:, :, kept],
        "note": seat.note,
    }


def _joints(body: Body) -> tuple[list[int], list[int]]:
    """Slots, the root's first, and the character's joints that they are drawn on."""
    slots = [slot for slot in range(body.layout.slots) if body.joints[slot + 1] >= 0]
    return [body.layout.slots, *slots], [body.joints[0], *(body.joints[slot + 1] for slot in slots)]
