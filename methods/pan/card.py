"""What PAN says of itself."""

from __future__ import annotations

from retarget_bench.api import MethodCard

PARAMETERS = {
    "variant": "own, released (as the authors' code), paper (as written)",
    "parts": "six, three (legs, spine, head), or a .toml file of part = [body parts]",
    "root": "the root's slot: velocity, height (velocity, but height), position; empty: as the variant",
    "lengths": "world (centimetres) or body (hip heights); empty: as the variant",
    "facing": "frames over which the direction faced is averaged; negative: as the variant",
    "yaw": "source (faces where it does) or predicted; empty: as the variant",
    "path": "of the root: decoded, or carried (the source's plus what is decoded); empty: as the variant",
    "statistics": "mean and deviation by structure or by character; empty: as the variant",
    "target_stats": "by character: transferred, or own (of the target's reference motions: privileged)",
    "conv_mask": "paper, or released (shifted by one slot); empty: as the variant",
    "decoder": "full, or parts (each slot from its own parts); empty: as the variant",
    "dropout": "share; negative: as the variant",
    "attention": "false: an MLP in its place (Table 5)",
    "by_part": "false: one token for the whole body (Table 5)",
    "kinematic": "weight of joints' places, eq. 13; negative: as the variant",
    "cycle": "weight of the distance of codes, eq. 11; negative: as the variant",
    "ends": "weight of end effectors' movement; negative: as the variant",
    "adversarial": "weight of eq. 12; negative: as the variant",
    "velocity": "weight of eq. 20; negative: as the variant",
    "tips": "ends of chains: copied or rest",
    "weights": "name of shipped weights, or a path to others",
}


def described(needs: tuple[str, ...]) -> MethodCard:
    """needs: privileged inputs."""
    return MethodCard(
        name="pan",
        summary="Attention by body part: codes that any structure with these parts can decode",
        version="1",
        paper="Hu, Zhang, Zhong, Jiang, Xia: Pose-aware Attention Network for Flexible Motion Retargeting "
        "by Body Part, TVCG 2023",
        needs=needs,
        parameters=PARAMETERS,
    )
