"""Linear blend skinning in torch: differentiable, for many frames of many bodies."""

from __future__ import annotations

import torch
from torch import Tensor

from retarget_bench.motion import rotation
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton


def skinned(vertices: Tensor, weights: Tensor, matrices: Tensor, shifts: Tensor) -> Tensor:
    """``(..., frames, V, 3)`` the vertices moved by the joints (Magnenat-Thalmann et al. 1988).

    vertices: ``(..., V, 3)``. weights: ``(..., V, joints)``, summing to 1. matrices, shifts: ``(...,
    frames, joints, 3, 3)`` and ``(..., frames, joints, 3)``, as ``joint_moves`` gives them.
    Leading dimensions are bodies, and broadcast; fill up smaller bodies with zeros. Gradients reach all.
    Skinning is linear in the transforms: one product of matrices moves all vertices, and none has a
    transform of its own.
    """
    points = torch.cat([vertices, torch.ones_like(vertices[..., :1])], dim=-1)
    shares = (weights[..., None] * points[..., None, :]).flatten(-2)  # (..., V, 4 joints)
    moves = torch.cat([matrices, shifts[..., None]], dim=-1)  # (..., frames, joints, 3, 4)
    frames = moves.shape[-4]
    columns = moves.transpose(-3, -2).flatten(-2).flatten(-3, -2)  # (..., frames * 3, 4 joints)
    coordinates = columns @ shares.transpose(-1, -2)  # (..., frames * 3, V)
    shape = (*coordinates.shape[:-2], frames, 3, coordinates.shape[-1])
    return coordinates.reshape(shape).transpose(-1, -2)


def joint_moves(
    positions: Tensor, rotations: Tensor, places: Tensor, turned: Tensor
) -> tuple[Tensor, Tensor]:
    """The transforms of joints from where a mesh has them to where they are.

    positions, rotations: ``(..., frames, joints, 3)`` and world orientations ``(..., frames, joints, 4)``.
    places, turned: ``(..., joints, 3)`` and ``(..., joints, 4)``: those of the mesh (``bound``).
    Returns matrices ``(..., frames, joints, 3, 3)`` and shifts ``(..., frames, joints, 3)``.
    """
    turns = rotation.multiply(rotations, rotation.conjugate(turned)[..., None, :, :].expand_as(rotations))
    matrices = rotation.to_matrix(turns)
    return matrices, positions - (matrices @ places[..., None, :, :, None])[..., 0]


def bound(
    mesh: Mesh, skeleton: Skeleton, dtype: torch.dtype = torch.float32, device: str = "cpu"
) -> tuple[Tensor, Tensor]:
    """Places ``(joints, 3)`` and orientations ``(joints, 4)`` of the joints in the mesh's own pose."""
    places, turned = mesh.bound(skeleton)
    return (
        torch.tensor(places, dtype=dtype, device=device),
        torch.tensor(turned, dtype=dtype, device=device),
    )
