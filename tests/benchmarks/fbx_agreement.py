"""BVH files beside what Blender makes of them as FBX: joints have to move alike.

Blender reads each BVH file, and writes it as FBX with every frame as a key. Both files are read here,
without importing: lengths stay in the unit of each file. Blender takes a unit of a BVH file for a metre and
writes centimetres, so places in the FBX file are divided by 100. Printed are the largest differences over
all frames and joints, of places as share of the body's reach, and of turns since the first frame in degrees
(FBX states Euler angles in single precision).

    python -m venv bpyenv && bpyenv/bin/pip install bpy==4.5.15
    python tests/benchmarks/fbx_agreement.py --blender bpyenv/bin/python walk.bvh
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from retarget_bench.motion import files, kinematics, rotation
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.recording import Recording, reach

BLENDER = """
import sys, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_anim.bvh(
    filepath=sys.argv[1], update_scene_fps=True, update_scene_duration=True, rotate_mode="NATIVE"
)
bpy.ops.export_scene.fbx(
    filepath=sys.argv[2], add_leaf_bones=False, bake_anim_simplify_factor=0.0, object_types={"ARMATURE"}
)
"""
SCALE = 100.0
"""Units of the FBX file in one of the BVH file."""


def convert(blender: Path, source: Path, path: Path) -> None:
    """Have Blender write a BVH file as FBX."""
    subprocess.run(
        [blender, "-c", BLENDER, source, path], check=True, timeout=900, stdout=subprocess.DEVNULL
    )


def world(recording: Recording, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places and turns ``(frames, joints, ...)`` of some joints."""
    at = [recording.skeleton.index(name) for name in names]
    places, turned = kinematics.forward(recording.skeleton, recording.rotations, recording.root)
    return places[:, at], turned[:, at]


def differences(bvh: Recording, fbx: Recording) -> tuple[float, float]:
    """The largest difference of places, as share of the body's reach, and of turns in degrees."""
    frames = min(len(bvh.root), len(fbx.root))
    names = bvh.skeleton.names
    (places, turned), (others, otherwise) = world(bvh, names), world(fbx, names)
    away = np.linalg.norm(places[:frames] - others[:frames] / SCALE, axis=-1).max() / reach(bvh.skeleton)
    since = rotation.multiply(turned[:frames], rotation.conjugate(turned[:1]))
    likewise = rotation.multiply(otherwise[:frames], rotation.conjugate(otherwise[:1]))
    return float(away), float(np.degrees(rotation.angle(since, likewise)).max())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", type=Path, help="BVH files")
    parser.add_argument("--blender", required=True, type=Path, help="a Python that has bpy")
    asked = parser.parse_args()
    print(f"{'file':32} joints frames    fps  (FBX)        places  degrees  read s")
    with tempfile.TemporaryDirectory() as folder:
        for path in asked.files:
            made = Path(folder) / f"{path.stem}.fbx"
            convert(asked.blender, path.resolve(), made)
            begin = time.perf_counter()
            fbx = files.read(made)
            seconds = time.perf_counter() - begin
            bvh = files.read(path, Reading(root_place="absolute"))  # as Blender takes it
            away, turned = differences(bvh, fbx)
            counts = (
                f"{len(bvh.skeleton):6} {len(bvh.root):6} {bvh.fps:7.3f} {fbx.fps:7.3f} {len(fbx.root):6}"
            )
            print(f"{path.name[:32]:32} {counts} {away:9.2e} {turned:8.1e} {seconds:7.2f}", flush=True)


if __name__ == "__main__":
    main()
