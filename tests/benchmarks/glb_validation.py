"""Whether GLB files that we write are valid, and what three.js makes of them in a browser.

Motions of people are retargeted to the glTF bodies of a folder and to bodies of BVH files, and motions of
the puppets are written with their skins. Khronos' validator says what is wrong with each result, beside
what it says of the file that the result was written into. A headless Chromium loads all of them with
three.js, whose world places of the joints must be ours to a millimetre, and its picture is for you to look
at.

Needs node and Chromium; packages are installed by npm as package.json pins them.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np

import retarget_bench as rb
from retarget_bench.errors import BenchError
from retarget_bench.motion.files import writing
from retarget_bench.motion.files.gltf.document import open_document
from retarget_bench.motion.files.gltf.reading import GltfScene
from retarget_bench.motion.files.scenes.reading import rigged
from retarget_bench.motion.importer import load
from retarget_bench.plugins import registry

HERE = Path(__file__).parent / "glb_validation"
FRAMES = slice(300, 390)
"""Of a source that are retargeted, at 30 per second."""
NEAR = 1e-3
"""Metres by which three.js may place a joint elsewhere than we do."""
SOURCES = ("lafan1/dance1_subject1.bvh", "cmu_bvh/01_01.bvh")
BVH_BODIES = ("lafan1/Lafan1_example.bvh", "mixamo_san/Kaya/Praying.bvh", "dog/Dog_example.bvh")
PUPPETS = ("ada", "leo", "stork", "hugo", "rex")
_LIMBS = {
    "CesiumMan.glb": {
        "hips": "Skeleton_torso_joint_1",
        "spine_1": "Skeleton_torso_joint_2",
        "spine_2": "torso_joint_3",
        "neck": "Skeleton_neck_joint_1",
        "head": "Skeleton_neck_joint_2",
        "left": "Skeleton_arm_joint_L__4_ Skeleton_arm_joint_L__3_ Skeleton_arm_joint_L__2_"
        " leg_joint_L_1 leg_joint_L_2 leg_joint_L_3 leg_joint_L_5",
        "right": "Skeleton_arm_joint_R Skeleton_arm_joint_R__2_ Skeleton_arm_joint_R__3_"
        " leg_joint_R_1 leg_joint_R_2 leg_joint_R_3 leg_joint_R_5",
    },
    "BrainStem.glb": {
        "hips": "node_3",
        "spine_1": "node_12",
        "head": "node_20",
        "left": "node_13 node_14 node_17 node_4 node_5 node_6 node_7",
        "right": "node_18 node_19 none node_8 node_9 node_10 node_11",
    },
}
"""Role, or the limbs of a side, of bodies whose names say nothing -> joints."""
_METHODS = {"RobotExpressive.glb": "copy_rotations[root_rule=height]"}
"""For bodies that the default method needs more of than they have: its feet stand beside it."""


def roles_of(file: Path) -> dict[str, str | None] | None:
    """Overrides of roles for a body whose names say nothing."""
    if file.name not in _LIMBS:
        return None
    known, found = _LIMBS[file.name], {}
    for role, joints in known.items():
        if role in ("left", "right"):
            parts = ("arm", "forearm", "hand", "up_leg", "leg", "foot", "toe")
            found |= {
                joint: f"{role}_{part}"
                for part, joint in zip(parts, joints.split(), strict=True)
                if joint != "none"
            }
        else:
            found[joints] = role
    return found


def written(data: Path, out: Path) -> dict[Path, Path | None]:
    """The results by file, with the file that each was written into, if any."""
    found: dict[Path, Path | None] = {}
    for name in SOURCES:
        source = rb.load_motion(data / name, fps=30).at(FRAMES)
        bodies = [*sorted((data / "gltf").glob("*.glb")), *(data / each for each in BVH_BODIES)]
        for body in bodies:
            target = rb.load_motion(body, roles=roles_of(body))
            path = out / f"{Path(name).stem}_{body.stem}.glb".replace(" ", "_")
            try:
                moved = rb.retarget(source, target, method=_METHODS.get(body.name, "ik"))
            except BenchError as error:
                print(f"{path.name}: {error}", file=sys.stderr)
                continue
            moved.save(path)
            found[path] = body if body.suffix == ".glb" else None
    puppets = registry.create("datasets", "puppets")
    for info in puppets.cases("retarget", "self"):
        path = out / f"puppet_{info.source}.glb"
        if info.source in PUPPETS and path not in found:
            writing.write(path, puppets.load(info).source)
            found[path] = None
    return found


def issues(files: list[Path]) -> dict[str, Counter[str]]:
    """What Khronos' validator says by file: how often each code, with its severity."""
    done = subprocess.run(
        ["node", str(HERE / "validate.mjs"), *map(str, files)], capture_output=True, text=True, check=True
    )
    levels = ("error", "warning", "information", "hint")
    return {
        file: Counter(f"{levels[each['severity']]} {each['code']}" for each in said)
        for file, said in json.loads(done.stdout).items()
    }


def apart(file: Path, shown: list[dict]) -> float:
    """Metres, the farthest that three.js places a joint from where we do, at the moments shown."""
    joints = rigged(GltfScene(open_document(file)), None, None)[0].body.joints
    found = load(file)
    motion, unit = found.motion, found.findings.unit[1]
    frames = [round(each["time"] * motion.fps) for each in shown]
    theirs = np.array([[each["places"][str(joint)] for joint in joints] for each in shown])
    return float(np.linalg.norm(unit * theirs - motion.positions[frames], axis=-1).max())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder with gltf/, lafan1/, cmu_bvh/, ...")
    parser.add_argument("-o", "--out", type=Path, default=Path("glb_validation"), help="folder for results")
    parser.add_argument("--chromium", default=shutil.which("chromium") or "chromium", help="its program")
    asked = parser.parse_args()
    if not (HERE / "node_modules").exists():
        subprocess.run(["npm", "install", "--no-audit", "--no-fund"], cwd=HERE, check=True)
    asked.out.mkdir(parents=True, exist_ok=True)
    results = written(asked.data, asked.out)
    found = issues([*results, *{body for body in results.values() if body}])
    picture = asked.out / "three.png"
    done = subprocess.run(
        ["node", str(HERE / "look.mjs"), asked.chromium, str(picture), *map(str, results)],
        capture_output=True,
        text=True,
        env=dict(os.environ),
    )
    if not done.stdout:
        sys.exit(done.stderr)
    seen = json.loads(done.stdout)
    bad = 0
    for file, body in results.items():
        own = found[str(file)] - (found[str(body)] if body else Counter())
        wrong = apart(file, seen["found"][str(file)]) if str(file) in seen["found"] else float("inf")
        bad += wrong > NEAR or any(code.startswith(("error", "warning")) for code in own)
        words = ", ".join(f"{count} x {code}" for code, count in sorted(own.items())) or "valid"
        old = sum(found[str(body)].values()) if body else 0
        kept = f" (and {old} of the body's own file)" if old else ""
        print(f"{file.name}: {words}{kept}; three.js {1000 * wrong:.2g} mm off")
    print(*seen["errors"], f"picture: {picture}", sep="\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
