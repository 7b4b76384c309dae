"""The Blender add-on, headless: places of the new action's joints against ``bench retarget`` on the files.

Runs where this Python has ``bpy``, or where ``RETARGET_BENCH_BPY`` names one that has.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.motion import bvh, importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from tests.motion.alignment_rigs import performance, t_pose

ROOT = Path(__file__).parents[1]
FRAMES = 40
IN_BLENDER = """
import json, os, sys, time
from types import SimpleNamespace
import bpy
asked = json.loads(sys.argv[-1])
sys.path.insert(0, asked["tools"])
import blender_retarget_bench as addon
addon.register()
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.preferences.addon_enable(module="io_anim_bvh")

def armature(file, **options):
    bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True, **options)
    return bpy.context.object

scene = bpy.context.scene
settings = scene.retarget_bench
settings.source = armature(asked["source"], global_scale=0.01, **asked["source_import"])
target = settings.target = armature(asked["target"], **asked["target_import"])
target.animation_data_clear()
for name, value in asked["transform"].items():
    setattr(target, name, value)
bpy.context.view_layer.update()
settings.command, settings.method = asked["command"], asked["method"]
scene.frame_set(7)

class Window:
    "Stands in for the window manager, which without a display passes no events."
    def event_timer_add(self, seconds, window):
        return "timer"
    def modal_handler_add(self, operator):
        self.operator = operator
    def event_timer_remove(self, timer):
        self.removed = timer

def in_background(cancel):
    "The operator as a button runs it: called again and again by a timer."
    said, window = [], Window()
    own = {name: value for name, value in vars(addon.RetargetOperator).items() if name[:3] != "bl_"}
    own["report"] = lambda self, kind, text: said.append(text)
    operator = type("Operator", (), own)()
    context = SimpleNamespace(scene=scene, window_manager=window, window=None)
    began = time.monotonic()
    answers = [operator.invoke(context, None)]
    busy = time.monotonic() - began, settings.running, operator._job.process.poll() is None
    folder = operator._job._at
    event = SimpleNamespace(type="ESC" if cancel else "TIMER", value="PRESS")
    while answers[-1] in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
        time.sleep(0.1)
        answers.append(operator.modal(context, event))
    over = operator._job.process.poll() is not None and not folder.exists() and window.removed == "timer"
    found = {"answers": [list(each)[0] for each in answers], "busy": busy, "over": over}
    return answers[-1], found, " ".join(said)

found = {}
try:
    if "cancel" in asked:
        done, found, said = in_background(asked["cancel"])
    else:
        done, said = bpy.ops.retarget_bench.retarget(), ""
except RuntimeError as error:
    done, said = set(), str(error)
found |= {"done": sorted(done), "said": said, "frame": scene.frame_current, "running": settings.running}
animation = target.animation_data
if animation is not None and animation.action is not None:
    start, end = animation.action.frame_range
    places = []
    for frame in range(int(start), int(end) + 1):
        scene.frame_set(frame)
        bones = target.pose.bones
        places.append({bone.name: list(target.matrix_world @ bone.head) for bone in bones})
    found |= {"action": animation.action.name, "range": [start, end], "places": places}
print("FOUND" + json.dumps(found), flush=True)
os._exit(0)  # bpy may never end by itself
"""


@cache
def blender() -> str | None:
    """A Python with bpy."""
    for python in (os.environ.get("RETARGET_BENCH_BPY"), sys.executable):
        asks = python and subprocess.run([python, "-c", "import bpy"], capture_output=True, check=False)
        if asks and asks.returncode == 0:
            return python
    return None


@pytest.fixture
def run(tmp_path):
    """Runs the add-on in Blender; answers with what it found."""
    python = blender()
    if python is None:
        pytest.skip("no bpy here; RETARGET_BENCH_BPY may name a Python that has it")

    def in_blender(source: Path, target: Path, **options: object) -> dict:
        job = {
            "source": str(source),
            "target": str(target),
            "tools": str(ROOT / "tools"),
            "transform": {},
        }
        job |= {"command": f"{sys.executable} -m retarget_bench", "method": "ik", "source_import": {}}
        job |= {"target_import": {"global_scale": 0.01}} | options
        completed = subprocess.run(
            [python, "-c", IN_BLENDER, json.dumps(job)],
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            timeout=120,
            check=False,
        )
        line = next((line for line in completed.stdout.splitlines() if line.startswith("FOUND")), None)
        assert line is not None, completed.stdout[-2000:] + completed.stderr[-2000:]
        return json.loads(line.removeprefix("FOUND"))

    return in_blender


@pytest.fixture
def files(tmp_path) -> tuple[Path, Path]:
    """A person who moves, in T-pose at rest, and a taller one in an A-pose, in centimetres."""
    person = Character.of("person", t_pose())
    root = np.array([0.3, 1.0, -0.2]) + 0.01 * np.arange(FRAMES)[:, None] * [1.0, 0.0, 2.0]
    bvh.write(tmp_path / "person.bvh", person.motion(performance(person, FRAMES), root, 30.0), scale=100)
    offsets = 1.15 * np.array(person.skeleton.offsets)
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        for part, length in (("ForeArm", 0.3), ("Hand", 0.26)):
            joint = person.skeleton.index(f"{side}{part}")
            offsets[joint] = length * np.array([sign * np.cos(0.8), -np.sin(0.8), 0.1])
    tall = Character.of("tall", replace(person.skeleton, offsets=offsets))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, len(offsets), 1))
    bvh.write(tmp_path / "tall.bvh", tall.motion(still, np.tile(offsets[0], (2, 1)), 30.0), scale=100)
    return tmp_path / "person.bvh", tmp_path / "tall.bvh"


def expected(source: Path, target: Path, method: str = "ik") -> importer.Imported:
    """What ``bench retarget`` makes of the files."""
    out = target.with_name("out.bvh")
    with pytest.raises(SystemExit) as stop:
        cli.main(
            [
                "retarget",
                f"{source}[unit=cm,up=y]",
                "--target",
                f"{target}[unit=cm,up=y]",
                "-o",
                str(out),
                "-m",
                method,
                "--quiet",
            ]
        )
    assert not stop.value.code
    return importer.load(out, Reading(unit="cm", up="y"))


def farthest(report: dict, loaded: importer.Imported, moved: tuple[float, float, float]) -> float:
    """Metres between the same joints in Blender (Z up) and in the file, at worst."""
    names = loaded.motion.skeleton.names
    x, y, z = (np.array([[row[name] for name in names] for row in report["places"]]) - moved).transpose(
        2, 0, 1
    )
    apart = np.linalg.norm(np.stack([x, z, -y], axis=-1) - loaded.motion.positions, axis=-1)
    print(f"{1000 * apart.max():.4f} mm")
    return float(apart.max())


UPRIGHT_OBJECT = {"axis_forward": "Y", "axis_up": "Z", "global_scale": 1.0}
"""Import options that leave the file's axes and unit as they are; the object says how it stands."""


@pytest.mark.parametrize(
    ("options", "moved"),
    [
        ({}, (0.0, 0.0, 0.0)),
        (
            {
                "target_import": {**UPRIGHT_OBJECT, "rotate_mode": "QUATERNION"},
                "transform": {
                    "rotation_euler": [np.pi / 2, 0, 0],
                    "scale": [0.01] * 3,
                    "location": [2, 1, 0.5],
                },
                "method": "copy_rotations",
            },
            (2.0, 1.0, 0.5),
        ),
    ],
    ids=["as imported", "turned, scaled and moved object"],
)
def test_the_action_is_what_the_command_makes_of_the_files(run, files, options, moved):
    """To a millimetre, in every joint and frame; the scene's frame stays."""
    report = run(*files, **options)
    assert (report["done"], report["frame"], report["running"]) == (["FINISHED"], 7, False)
    assert report["action"] == "person on tall"
    assert len(report["places"]) == FRAMES
    assert farthest(report, expected(*files, options.get("method", "ik")), moved) < 1e-3


@pytest.mark.parametrize("cancel", [False, True])
def test_the_button_does_not_wait_for_the_command(run, files, cancel):
    report = run(*files, method="copy_rotations", cancel=cancel)
    seconds, running, alive = report["busy"]
    assert seconds < 5
    assert running
    assert alive
    assert report["answers"][0] == "RUNNING_MODAL"
    assert report["over"]  # the command ended, its folder and the timer are gone
    assert not report["running"]
    if cancel:
        assert report["answers"][1:] == ["CANCELLED"]
        assert "action" not in report
    else:
        assert set(report["answers"][1:-1]) == {"PASS_THROUGH"}
        assert report["answers"][-1] == "FINISHED"
        assert farthest(report, expected(*files, "copy_rotations"), (0.0, 0.0, 0.0)) < 1e-3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "no_such_method"}, "no_such_method"),
        ({"command": "/no/such/bench"}, "was not found"),
        ({"transform": {"scale": [1.0, 2.0, 1.0]}}, "apply its scale"),
    ],
)
def test_errors_are_reports_and_leave_the_target_alone(run, files, options, message):
    report = run(*files, **options)
    assert message in report["said"]
    assert "Traceback" not in report["said"]
    assert (report["done"], report["running"], "action" in report) == ([], False, False)
