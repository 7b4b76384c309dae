"""Blender add-on: the motion of one armature, retargeted to another as a new action by ``bench retarget``.

Install this file in Blender (Edit, Preferences, Add-ons, Install from Disk); ``bench`` has to be installed
somewhere, in any Python. The panel is in the sidebar of the 3D view, tab "Retarget". See docs/retarget.md.

Both armatures go to the command as BVH files that are written here, with joints at the heads of bones, in
metres and Y up, and whose joints are all parallel to the world at rest. So neither bone roll nor the axes
of bones play a part, and scale, rotation and parents of the objects are those that the scene shows. The
answer is turned back into the bones' own axes.
"""

import json
import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
from mathutils import Euler, Matrix, Quaternion, Vector

bl_info = {
    "name": "retarget-bench",
    "author": "retarget-bench",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > Retarget",
    "description": "Retarget the motion of an armature to another one",
    "category": "Animation",
}

METHODS = (
    ("ik", "Copied rotations, feet planted, hands reached (default)"),
    ("copy_rotations", "Copied rotations alone"),
    ("ik+footfix", "Feet fixed afterwards"),
    ("pan", "Learned: pose-aware attention by body part"),
    ("pmnet", "Learned: poses and movement apart"),
    ("r2et", "Learned: R2ET's skeleton-aware network"),
)
"""Suggestions; any method that ``bench list`` shows, with parameters, can be typed."""
UPRIGHT = Matrix(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))).to_quaternion()
"""From Blender's axes (Z up) to those of the files (Y up)."""
EVEN = 1e-3
"""Share by which the scales of an armature's axes may differ."""
WAIT = 0.2
"""Seconds between looks at the running command."""


class CannotRetarget(Exception):
    """The reason why, as a sentence for the user."""


# --------------------------------------------------------------------------------------- armatures as BVH
@dataclass(frozen=True)
class Body:
    """An armature as joints: the bones of its largest tree, parents first.

    metres: of one unit of the scene. rest: world orientation of each bone at rest, in Blender's axes.
    heads: world places at rest, as seen from the object's origin. origin: of the object, in the world.
    """

    armature: bpy.types.Object
    bones: list[bpy.types.Bone]
    metres: float
    rest: list[Quaternion]
    heads: list[Vector]
    origin: Vector

    @property
    def parents(self) -> list[int]:
        number = {bone.name: index for index, bone in enumerate(self.bones)}
        return [number[bone.parent.name] if index else -1 for index, bone in enumerate(self.bones)]


def body_of(armature: bpy.types.Object, scene: bpy.types.Scene) -> Body:
    """The armature as it stands in the scene now. Raises CannotRetarget."""
    roots = [bone for bone in armature.data.bones if bone.parent is None]
    if not roots:
        raise CannotRetarget(f"{armature.name} has no bones")
    root = max(roots, key=lambda bone: len(bone.children_recursive))
    world = armature.matrix_world
    scales = [abs(axis) for axis in world.to_scale()]
    if min(scales) <= 0 or max(scales) > (1 + EVEN) * min(scales) or world.is_negative:
        raise CannotRetarget(
            f"{armature.name} is scaled differently along its axes, or mirrored: apply its scale first"
        )
    bones = list(_depth_first(root))
    turned = world.to_quaternion()
    return Body(
        armature,
        bones,
        scene.unit_settings.scale_length,
        [turned @ bone.matrix_local.to_quaternion() for bone in bones],
        [world.to_3x3() @ bone.head_local for bone in bones],
        world.translation.copy(),
    )


def _depth_first(bone: bpy.types.Bone) -> Iterator[bpy.types.Bone]:
    yield bone
    for child in bone.children:
        yield from _depth_first(child)


def frames_of(armature: bpy.types.Object, scene: bpy.types.Scene) -> range:
    """The frames of the armature's action, or of the scene where it has none."""
    animation = armature.animation_data
    if animation is not None and animation.action is not None:
        start, end = animation.action.frame_range
        return range(int(start), int(end) + 1)
    return range(scene.frame_start, scene.frame_end + 1)


def hierarchy(body: Body) -> list[str]:
    """The lines of a BVH file up to its motion."""
    parents, lines = body.parents, ["HIERARCHY"]
    open_joints: list[int] = []
    for joint, bone in enumerate(body.bones):
        while open_joints and open_joints[-1] != parents[joint]:
            lines.append("  " * (len(open_joints) - 1) + "}")
            open_joints.pop()
        indent = "  " * len(open_joints)
        above = body.heads[parents[joint]] if joint else Vector()
        kind = "JOINT" if joint else "ROOT"
        name = "".join("_" if sign in "{}\r\n\t" else sign for sign in bone.name).strip() or f"bone_{joint}"
        lines += [f"{indent}{kind} {name}", f"{indent}{{"]
        lines.append(f"{indent}  OFFSET {_numbers(_metres(body, body.heads[joint] - above))}")
        turns = "Zrotation Xrotation Yrotation"
        places = "Xposition Yposition Zposition "
        lines.append(f"{indent}  CHANNELS {3 if joint else 6} {'' if joint else places}{turns}")
        if not bone.children:
            tip = body.rest[joint] @ Vector((0.0, bone.length * _size(body), 0.0))
            lines += [f"{indent}  End Site", f"{indent}  {{"]
            lines += [f"{indent}    OFFSET {_numbers(_metres(body, tip))}", f"{indent}  }}"]
        open_joints.append(joint)
    return lines + ["  " * depth + "}" for depth in range(len(open_joints) - 1, -1, -1)]


def _size(body: Body) -> float:
    return sum(abs(axis) for axis in body.armature.matrix_world.to_scale()) / 3


def _metres(body: Body, place: Vector) -> Vector:
    return UPRIGHT @ (place * body.metres)


def _numbers(values: Iterator[float] | Vector) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def write_bvh(path: Path, body: Body, frames: range, scene: bpy.types.Scene) -> None:
    """The motion of an armature as the scene shows it, constraints included; the scene's frame is kept."""
    lines = [*hierarchy(body), "MOTION", f"Frames: {len(frames)}", f"Frame Time: {_seconds(scene):.12g}"]
    parents, before = body.parents, scene.frame_current
    try:
        for frame in frames:
            scene.frame_set(frame)
            shown = body.armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
            lines.append(_frame_line(body, parents, shown))
    finally:
        scene.frame_set(before)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_rest(path: Path, body: Body, scene: bpy.types.Scene) -> None:
    """An armature at rest, as a file of two frames."""
    still = [*_metres(body, body.heads[0]), *[0.0] * (3 * len(body.bones))]
    motion = ["MOTION", "Frames: 2", f"Frame Time: {_seconds(scene):.12g}", *[_numbers(still)] * 2]
    path.write_text("\n".join([*hierarchy(body), *motion]) + "\n", encoding="utf-8")


def _seconds(scene: bpy.types.Scene) -> float:
    return scene.render.fps_base / scene.render.fps


def _frame_line(body: Body, parents: list[int], shown: bpy.types.Object) -> str:
    """The channels of a frame: how each bone is turned away from its rest, in the axes of the file."""
    world, turned = shown.matrix_world, []
    around = world.to_quaternion()
    for bone, rest in zip(body.bones, body.rest, strict=True):
        now = around @ shown.pose.bones[bone.name].matrix.to_quaternion()
        turned.append(UPRIGHT @ now @ rest.inverted() @ UPRIGHT.inverted())
    root = world @ shown.pose.bones[body.bones[0].name].head - body.origin
    values = list(_metres(body, root))
    for joint, parent in enumerate(parents):
        local = turned[joint] if parent < 0 else turned[parent].inverted() @ turned[joint]
        # channels Z, X, Y turn about the axes of the joint: Blender's order YXZ, about fixed axes
        x, y, z = (57.29577951308232 * angle for angle in local.to_euler("YXZ"))
        values += [z, x, y]
    return _numbers(values)


# ------------------------------------------------------------------------------------- BVH as an action
def read_bvh(path: Path, joints: int) -> tuple[list[Vector], list[list[Quaternion]]]:
    """Places of the root (metres) and local turns by frame and joint, of a file like ``hierarchy``'s.

    Raises CannotRetarget where the file has other joints.
    """
    head, _, motion = path.read_text(encoding="utf-8").partition("MOTION")
    channels = [line.split()[2:] for line in head.splitlines() if line.split()[:1] == ["CHANNELS"]]
    if len(channels) != joints:
        raise CannotRetarget(f"the command answered with {len(channels)} joints instead of {joints}")
    places, turns = [], []
    for line in motion.splitlines():
        words = line.split()
        if not words or words[0].startswith("Frame"):
            continue
        values, at, row = [float(word) for word in words], 0, []
        for number, names in enumerate(channels):
            place, turn = [0.0, 0.0, 0.0], Quaternion()
            for name, value in zip(names, values[at : at + len(names)], strict=True):
                axis = "XYZ".index(name[0])
                if name.endswith("position"):
                    place[axis] = value
                else:
                    unit = Vector([float(axis == other) for other in range(3)])
                    turn = turn @ Quaternion(unit, value / 57.29577951308232)
            at += len(names)
            row.append(turn)
            if number == 0:
                places.append(Vector(place))
        turns.append(row)
    return places, turns


def make_action(
    body: Body, places: list[Vector], turns: list[list[Quaternion]], first: int, name: str
) -> bpy.types.Action:
    """A new action of the armature, in use by it, with a key at every frame from the first on."""
    animation = body.armature.animation_data or body.armature.animation_data_create()
    action = bpy.data.actions.new(name)
    animation.action = action
    parents, world = body.parents, body.armature.matrix_world
    pose = body.armature.pose.bones
    keys: dict[str, list[list[float]]] = {}
    before: list[Quaternion | Euler | None] = [None] * len(body.bones)
    for place, row in zip(places, turns, strict=True):
        matrices = _pose(body, parents, world.inverted(), place, row)
        for joint, bone in enumerate(body.bones):
            basis = _basis(bone, matrices, joint, parents[joint])
            path, values, before[joint] = _rotation(pose[bone.name], basis, before[joint])
            keys.setdefault(path, []).append(values)
            if joint == 0:
                keys.setdefault(pose[bone.name].path_from_id("location"), []).append(
                    list(basis.translation)
                )
    for joint, bone in enumerate(body.bones):  # what is not animated has to be at rest
        keys[pose[bone.name].path_from_id("scale")] = [[1.0, 1.0, 1.0]]
        if joint:
            keys[pose[bone.name].path_from_id("location")] = [[0.0, 0.0, 0.0]]
    _fill(body, action, keys, first)
    return action


def _pose(
    body: Body, parents: list[int], back: Matrix, place: Vector, row: list[Quaternion]
) -> list[Matrix]:
    """Matrices of the bones in the armature's own space, as they are in a frame of the answer."""
    around, matrices, turned = back.to_quaternion(), [], []
    for joint, parent in enumerate(parents):
        turned.append(row[joint] if parent < 0 else turned[parent] @ row[joint])
        now = around @ UPRIGHT.inverted() @ turned[joint] @ UPRIGHT @ body.rest[joint]
        if parent < 0:
            head = back @ (UPRIGHT.inverted() @ place / body.metres + body.origin)
        else:
            rest = body.bones[parent].matrix_local.inverted() @ body.bones[joint].head_local
            head = matrices[parent] @ rest
        matrices.append(Matrix.LocRotScale(head, now, None))
    return matrices


def _basis(bone: bpy.types.Bone, matrices: list[Matrix], joint: int, parent: int) -> Matrix:
    """The channels with which a bone has its matrix, whatever it inherits."""
    if parent < 0:
        return bone.convert_local_to_pose(matrices[joint], bone.matrix_local, invert=True)
    return bone.convert_local_to_pose(
        matrices[joint],
        bone.matrix_local,
        parent_matrix=matrices[parent],
        parent_matrix_local=bone.parent.matrix_local,
        invert=True,
    )


def _rotation(
    bone: bpy.types.PoseBone, basis: Matrix, before: Quaternion | Euler | None
) -> tuple[str, list[float], Quaternion | Euler]:
    """Data path and values of a bone's turn in its own rotation mode, without jumps between frames."""
    turned = basis.to_quaternion()
    if bone.rotation_mode == "QUATERNION":
        if before is not None and before.dot(turned) < 0:
            turned.negate()
        return bone.path_from_id("rotation_quaternion"), list(turned), turned
    if bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turned.to_axis_angle()
        return bone.path_from_id("rotation_axis_angle"), [angle, *axis], turned
    angles = (
        turned.to_euler(bone.rotation_mode, before)
        if before is not None
        else turned.to_euler(bone.rotation_mode)
    )
    return bone.path_from_id("rotation_euler"), list(angles), angles


def _fill(body: Body, action: bpy.types.Action, keys: dict[str, list[list[float]]], first: int) -> None:
    """Curves of an action: data path -> values by frame; of one frame, a single key."""
    bones = {bone.path_from_id(): bone.name for bone in body.armature.pose.bones}
    for path in keys:  # Blender makes the curves, which later versions keep elsewhere in an action
        owner, _, channel = path.rpartition(".")
        body.armature.pose.bones[bones[owner]].keyframe_insert(channel, frame=first, group=bones[owner])
    for curve in _curves(action):
        values = [row[curve.array_index] for row in keys[curve.data_path]]
        curve.keyframe_points.add(len(values) - len(curve.keyframe_points))
        spots = [number for k, value in enumerate(values) for number in (float(first + k), value)]
        curve.keyframe_points.foreach_set("co", spots)
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
        curve.update()


def _curves(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [curve for bag in action.layers[0].strips[0].channelbags for curve in bag.fcurves]


# ------------------------------------------------------------------------------------------ the command
def command_line(text: str) -> list[str]:
    """The words of a command: a program, or a program with arguments. Raises CannotRetarget."""
    text = bpy.path.abspath(text.strip()) if text.strip().startswith("//") else text.strip()
    words = [text] if Path(text).is_file() else shlex.split(text, posix=os.name != "nt")
    if not words or shutil.which(words[0]) is None:
        raise CannotRetarget(
            f"the command {text or 'bench'!r} was not found: install retarget-bench, and give the path of "
            "its program bench"
        )
    return words


def as_read(path: Path, roles: str) -> str:
    """A file that this wrote, as the command takes it. roles: a file of what its bones are; "": none."""
    options = "unit=m,up=y,root_place=absolute"
    if roles:
        options += f",roles={json.dumps(bpy.path.abspath(roles), ensure_ascii=False)}"
    return f"{path}[{options}]"


class Job:
    """One run of the command, in a temporary folder that goes with it. Raises CannotRetarget."""

    def __init__(self, context: bpy.types.Context) -> None:
        settings, scene = context.scene.retarget_bench, context.scene
        if settings.source is None or settings.target is None or settings.source == settings.target:
            raise CannotRetarget("pick two armatures, a source with motion and another target")
        words = command_line(settings.command)
        self.source, self.target = body_of(settings.source, scene), body_of(settings.target, scene)
        self.frames = frames_of(settings.source, scene)
        self._folder = tempfile.TemporaryDirectory(prefix="retarget_bench_")
        self._at = Path(self._folder.name)
        try:
            # the names of files are those of characters in messages
            motion, body = self._at / "source.bvh", self._at / "target.bvh"
            write_bvh(motion, self.source, self.frames, scene)
            write_rest(body, self.target, scene)
            line = [*words, "retarget", as_read(motion, settings.source_roles)]
            line += ["--target", as_read(body, settings.target_roles)]
            line += ["-o", str(self._at / "out.bvh"), "-m", settings.method or "ik"]
            self._said = (self._at / "said.txt").open("w+b")
            environment = {name: value for name, value in os.environ.items() if name != "PYTHONHOME"}
            self.process = subprocess.Popen(
                line, stdout=self._said, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=environment
            )
        except BaseException:
            self._folder.cleanup()
            raise

    def finish(self) -> tuple[bpy.types.Action, list[str]]:
        """The new action, and what the command said. Raises CannotRetarget with the command's own words."""
        self._said.seek(0)
        lines = [line for line in self._said.read().decode("utf-8", "replace").splitlines() if line.strip()]
        lines = [self._readable(line.removeprefix("bench: ")) for line in lines]
        if self.process.returncode != 0:
            raise CannotRetarget(
                " ".join(lines[-3:]) or f"the command ended with {self.process.returncode}"
            )
        places, turns = read_bvh(self._at / "out.bvh", len(self.target.bones))
        animation = self.source.armature.animation_data
        source_name = animation.action.name if animation and animation.action else self.source.armature.name
        name = f"{source_name} on {self.target.armature.name}"
        return make_action(self.target, places, turns, self.frames.start, name), lines

    def _readable(self, line: str) -> str:
        """A line that names the armatures, not the temporary files."""
        for file, body in (("source.bvh", self.source), ("target.bvh", self.target)):
            line = line.replace(str(self._at / file), body.armature.name)
        return line.replace(str(self._at / "out.bvh"), "the action")

    def close(self) -> None:
        """End the command where it still runs, and remove its files."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._said.close()
        self._folder.cleanup()


class RetargetOperator(bpy.types.Operator):
    """Retarget the motion of the source armature to the target armature, as a new action"""

    bl_idname = "retarget_bench.retarget"
    bl_label = "Retarget"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    _job: Job | None = None
    _timer = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        settings = context.scene.retarget_bench
        return settings.source is not None and settings.target is not None and not settings.running

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run and wait, as scripts do."""
        if not self._begin(context):
            return {"CANCELLED"}
        self._job.process.wait()
        return self._end(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Run in the background; the timer looks for the end."""
        if not self._begin(context):
            return {"CANCELLED"}
        context.scene.retarget_bench.running = True
        manager = context.window_manager
        self._timer = manager.event_timer_add(WAIT, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            self.report({"WARNING"}, "retargeting was cancelled")
            self._close(context)
            return {"CANCELLED"}
        if event.type != "TIMER" or self._job.process.poll() is None:
            return {"PASS_THROUGH"}
        return self._end(context)

    def cancel(self, context: bpy.types.Context) -> None:
        self._close(context)

    def _begin(self, context: bpy.types.Context) -> bool:
        try:
            self._job = Job(context)
        except (CannotRetarget, OSError) as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _end(self, context: bpy.types.Context) -> set[str]:
        try:
            action, lines = self._job.finish()
        except (CannotRetarget, OSError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            self._close(context)
        bound = [bone.name for bone in self._job.target.armature.pose.bones if bone.constraints]
        if bound:
            lines.insert(0, f"{len(bound)} bones of the target have constraints, which go over the action")
        for line in lines[:-1]:
            self.report({"WARNING"}, line)
        self.report({"INFO"}, f"{action.name}: {lines[-1] if lines else 'done'}")
        return {"FINISHED"}

    def _close(self, context: bpy.types.Context) -> None:
        context.scene.retarget_bench.running = False
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        self._job.close()


# ------------------------------------------------------------------------------------------ the interface
def _is_armature(_settings: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    return candidate.type == "ARMATURE"


def _suggested(
    _settings: bpy.types.PropertyGroup, _context: bpy.types.Context, typed: str
) -> Iterator[tuple[str, str]]:
    return ((name, about) for name, about in METHODS if typed.lower() in name)


class Settings(bpy.types.PropertyGroup):
    """The panel's settings, kept with the scene."""

    source: bpy.props.PointerProperty(
        type=bpy.types.Object, poll=_is_armature, name="Source", description="The armature that moves"
    )
    target: bpy.props.PointerProperty(
        type=bpy.types.Object,
        poll=_is_armature,
        name="Target",
        description="The armature that gets the action",
    )
    method: bpy.props.StringProperty(
        name="Method",
        default="ik",
        search=_suggested,
        search_options={"SUGGESTION"},
        description="A method that bench list shows, with parameters in brackets",
    )
    command: bpy.props.StringProperty(
        name="Command",
        default="bench",
        description="The program bench, or its path; or a Python with -m retarget_bench",
    )
    source_roles: bpy.props.StringProperty(
        name="Source roles",
        subtype="FILE_PATH",
        description="What bones are, where names do not tell (TOML)",
    )
    target_roles: bpy.props.StringProperty(
        name="Target roles",
        subtype="FILE_PATH",
        description="What bones are, where names do not tell (TOML)",
    )
    running: bpy.props.BoolProperty(options={"SKIP_SAVE", "HIDDEN"})


class RetargetPanel(bpy.types.Panel):
    """The panel in the sidebar."""

    bl_idname = "VIEW3D_PT_retarget_bench"
    bl_label = "retarget-bench"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Retarget"

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.retarget_bench, self.layout
        layout.use_property_split = True
        for name in ("source", "target", "method", "source_roles", "target_roles", "command"):
            layout.prop(settings, name)
        running = settings.running
        text = "Running (Esc cancels)" if running else "Retarget"
        layout.operator(RetargetOperator.bl_idname, text=text, icon="ARMATURE_DATA")


CLASSES = (Settings, RetargetOperator, RetargetPanel)


def register() -> None:
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.retarget_bench = bpy.props.PointerProperty(type=Settings)


def unregister() -> None:
    del bpy.types.Scene.retarget_bench
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)


if __name__ == "__main__":
    register()
