"""Scenes made by hand: people and dogs that do simple things, among figures of every kind there is."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
from viewing_toys.toy_moves import DOG, PERSON, body

from retarget_bench.api import Ground
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.viewer import player
from retarget_bench.viewer.packing import packed
from retarget_bench.viewer.scene import Figure, Scene
from retarget_bench.viewer.skins import IN_PAGES

FRAMES = 24
EVIL = '<img src=x onerror="boom()">"\'&\u2028 </script><b>ű名'


def acted(character: Character, frames: int = FRAMES, lean: float = 0.0, shift: float = 0.0) -> Motion:
    """Legs and arms swing while the root goes on; all lean aside, and stand ``shift`` metres lower."""
    time = np.arange(frames) / 30.0
    turns = np.zeros((frames, len(character.skeleton), 3))
    for role, sign in (("left_up_leg", 1), ("right_up_leg", -1), ("left_arm", -1), ("right_arm", 1)):
        turns[:, character.joint_of[role], 0] = 0.5 * sign * np.sin(2 * np.pi * time)
    for role, side in (("left_arm", -1.1), ("right_arm", 1.1)):
        turns[:, character.joint_of[role], 2] += side
    turns[:, 0, 2] += lean
    root = character.skeleton.offsets[0] + np.array([0, 0, 0.6]) * time[:, None] - [0, shift, 0]
    return character.motion(rotation.from_rotation_vector(turns), root, 30.0)


def figure(label: str, part: str, motion: Motion, reference: Motion | None = None) -> Figure:
    """A figure whose left foot stands in the first half, and with its error where there is a reference."""
    joints = tuple(motion.character.joints(("left_foot", "left_toe", "right_foot", "right_toe")))
    planted = np.zeros((motion.frames, len(joints)), dtype=bool)
    planted[: motion.frames // 2, 0] = True
    error = None
    if reference is not None:
        off = np.linalg.norm(motion.positions - reference.positions, axis=-1).mean(axis=1)
        error = 100.0 * off / motion.character.height + np.linspace(0.0, 2.0, motion.frames) ** 2
    return Figure(
        label,
        part,
        motion.character,
        motion.positions,
        motion,
        joints,
        planted,
        error,  # type: ignore[arg-type]
    )


def scene(frames: int = FRAMES, ground: Ground | None = None, four_legged: bool = False) -> Scene:
    """Source, reference, three methods (one of which sinks) and one that failed."""
    small, tall = (
        body(name, DOG if four_legged else PERSON, size) for name, size in (("S", 1), ("T", 1.2))
    )
    right = acted(tall, frames)
    figures = (
        figure("source", "source", acted(small, frames)),
        figure("reference", "reference", right),
        figure("good", "prediction", acted(tall, frames, lean=0.04), right),
        figure("leaning", "prediction", acted(tall, frames, lean=0.3), right),
        figure("sunk", "prediction", acted(tall, frames, shift=0.1), right),
        Figure("broken", "prediction", tall, None, status="failed", message="ValueError: no luck at all"),
    )
    return Scene("a walk", figures, 30.0, "toys/S>T/walk", ground=ground or Ground())


def clad(character: Character, seed: int = 3, triangles: int = 400) -> Character:
    """With a skin: small triangles around the joints, whose corners follow these and up to three above."""
    chance = np.random.default_rng(seed)
    joints = chance.integers(0, len(character.skeleton), triangles)
    pose = rotation.from_rotation_vector(0.3 * chance.normal(size=(len(character.skeleton), 3)))
    places, _ = kinematics.forward(character.skeleton, pose, character.skeleton.offsets[0])
    corners = places[joints, None] + chance.normal(size=(triangles, 3, 3)) * 0.06
    parents = np.maximum(character.skeleton.parents, 0)
    weights = np.zeros((3 * triangles, len(character.skeleton)))
    for row, joint in zip(weights, joints.repeat(3), strict=True):
        for share in chance.dirichlet((4, 2, 1, 0.3)):
            row[joint] += share
            joint = parents[joint]
    faces = np.arange(3 * triangles).reshape(-1, 3)
    skin = Mesh(corners.reshape(-1, 3), faces, weights, pose)
    return replace(character, skin=lambda: skin)


def clad_scene() -> Scene:
    """Two with skins, one of whom is known by positions only, and one body that has no skin."""
    person = clad(body("T", PERSON, 1.2))
    moved = acted(person)
    return Scene(
        "skins",
        (
            figure("clad", "motion", moved),
            replace(figure("places", "motion", moved), motion=None),
            figure("bare", "motion", acted(body("S"))),
        ),
        30.0,
    )


def hostile() -> Scene:
    """Every name that there is could end an element or start one."""
    evil = Character.of(EVIL, Skeleton((EVIL,), np.array([-1]), np.zeros((1, 3))))
    positions = np.zeros((2, 1, 3))
    return Scene(
        EVIL,
        (
            Figure(EVIL, "source", evil, positions, error=np.ones(2)),
            Figure(EVIL + "2", "prediction", evil, positions, error=np.ones(2)),
            Figure(EVIL + "3", "prediction", evil, None, status="failed", message=EVIL),
        ),
        30.0,
        case=EVIL,
    )


def many_joints(joints: int = 200, frames: int = 10) -> Scene:
    """A chain without roles, known by positions only."""
    names = tuple(f"joint {number}" for number in range(joints))
    skeleton = Skeleton(names, np.arange(joints) - 1, np.tile([0.0, 0.01, 0.0], (joints, 1)))
    places = np.cumsum(np.tile([0.0, 0.01, 0.0], (frames, joints, 1)), axis=1)
    places[..., 0] += 0.1 * np.sin(np.arange(joints) / 9.0 + np.arange(frames)[:, None])
    return Scene("a snake", (Figure("snake", "motion", Character.of("snake", skeleton), places),), 30.0)


def page(*scenes: Scene, options: dict | None = None, skins: bool = False) -> str:
    """A page with the scenes in it and a player of the first; ``show(number)`` mounts another."""
    texts = [player.data(packed(each, IN_PAGES if skins else 0)) for each in scenes]
    held = "".join(
        f'<script type="application/json" id="scene-{number}">{text}</script>'
        for number, text in enumerate(texts)
    )
    policy = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
    return f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>motion</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="color-scheme" content="light dark">
<style>body {{ margin: 8px; }}\n{player.style()}</style></head><body>
<input aria-label="elsewhere" id="elsewhere"><div id="place"></div>{held}<script>{player.script()}
let view;
const packed = (i) => JSON.parse(document.getElementById("scene-" + i).textContent);
const place = document.getElementById("place");
const show = (i, options) => (view = RetargetPlayer.mount(place, packed(i), options));
show(0, {json.dumps(options or {})});
</script></body></html>"""
