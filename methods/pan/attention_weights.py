"""Attention of body parts to joints, as PAN's first layer gives it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from retarget_bench.errors import NotSupported
from retarget_bench.motion import rates
from retarget_bench.motion.character import interpolated
from retarget_bench.motion.motion import Motion
from retarget_bench.training.layers.skeletal.inference import PIECE

from .network import body_parts

if TYPE_CHECKING:
    from . import Pan


def attended(method: Pan, source: Motion) -> dict[str, Any]:
    """Attention weights of the first layer by joint of the source (section 6.2.2).

    The entries of ``retarget_bench.evaluation.attention.Attention``, for a source that the method supports.
    The weight of an edge is shown at the joint that it leads to, that of the root's channels at the hips.
    Edges that lead to no joint of this body are left out.
    Raises NotSupported where the networks have no attention.
    """
    assignment, settings = method.assignment(source.character), method.settings
    structure, body = method.structures[assignment.structure], assignment.body
    if not settings.design.attention:
        raise NotSupported("pan[attention=false] has an MLP in the place of attention, and no weights")
    shown = rates.at_thirty(source)
    assert isinstance(shown, Motion)
    edges = torch.from_numpy(settings.features.see(shown, body)["edges"].astype(np.float32))
    (row,) = structure.statistics_row([source.character.name])
    normalised = structure.normalised(edges.unsqueeze(0), torch.tensor([row]))
    with torch.inference_mode():
        pieces = torch.split(normalised, PIECE, 1)
        chunks = [structure.encoder.attention(piece)[0].numpy() for piece in pieces]
    leads, attention = body.layout.leads, np.concatenate(chunks)
    if body.layout.slots == "joints":  # the hips' rotation and the root's movement are one joint's
        attention[:, :, -1] += attention[:, :, 0]
    led = [edge for edge, joint in enumerate(leads) if joint > 0 and body.joints[joint] >= 0]
    order = [body.layout.edges, *led]
    joints = [body.joints[0], *(body.joints[leads[edge]] for edge in led)]
    parts = body_parts(body.layout, settings.design)
    sees = np.array([[edge in part for edge in order] for part in parts])
    visible = sees.any(axis=0)
    low, share = rates.between(source.frames, source.fps, rates.FPS, shown.frames)
    weights = interpolated(attention[:, :, order], low, share)
    return {
        "parts": body.layout.names if settings.design.by_part else ("whole body",),
        "joints": np.array(joints)[visible],
        "sees": sees[:, visible],
        "weights": weights[:, :, visible],
        "note": assignment.note,
    }
