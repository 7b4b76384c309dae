"""How long GLB files take to read, beside trimesh.

Processor time of the fastest of some reads: skeleton and first animation; the same with the mesh on its
joints; and trimesh, which reads meshes and the tree of nodes, and neither skins nor animations. Both have
to find the same triangles, but for those of nodes that stand beside the body.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import trimesh

from retarget_bench.motion import files
from retarget_bench.motion.mesh import Mesh


def fastest(work: Callable[[], object], rounds: int) -> float:
    """Milliseconds of processor time."""
    found = []
    for _ in range(rounds):
        start = time.process_time()
        work()
        found.append(time.process_time() - start)
    return 1000 * min(found)


def mesh_of(path: Path) -> Mesh | None:
    skin = files.read(path).skin
    return None if skin is None else skin()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path, help="GLB files")
    parser.add_argument("--rounds", type=int, default=7)
    asked = parser.parse_args()
    print(f"{'file':24} joints frames triangles (trimesh)  read ms  with mesh  trimesh")
    for path in asked.files:
        recording, mesh = files.read(path), mesh_of(path)
        triangles = 0 if mesh is None else len(mesh.faces)
        others = sum(len(each.faces) for each in trimesh.load_scene(path).geometry.values())
        assert triangles <= others, f"{path}: {triangles} triangles, and trimesh finds {others}"
        ours = fastest(lambda path=path: files.read(path), asked.rounds)
        dressed = fastest(lambda path=path: mesh_of(path), asked.rounds)
        theirs = fastest(lambda path=path: trimesh.load_scene(path), asked.rounds)
        counts = f"{len(recording.skeleton):6} {len(recording.root):6} {triangles:9} {others:9}"
        print(f"{path.name:24} {counts} {ours:9.1f} {dressed:10.1f} {theirs:8.1f}")


if __name__ == "__main__":
    main()
