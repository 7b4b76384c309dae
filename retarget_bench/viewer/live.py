"""The live view: scenes in three dimensions in a local browser page (viser)."""

import importlib
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from http import HTTPStatus
from importlib.util import find_spec
from io import StringIO
from typing import Any

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.motion.facing import facing
from retarget_bench.motion.ground import ground_height
from retarget_bench.viewer import floor
from retarget_bench.viewer.bodies import Solid
from retarget_bench.viewer.colours import CONTACT, FLOOR, LIT, colours
from retarget_bench.viewer.models import Model
from retarget_bench.viewer.scene import Scene
from retarget_bench.viewer.scene_builder import CaseList, dressed
from retarget_bench.viewer.self_penetration import lit_faces
from retarget_bench.viewer.text import plain

HOST = "127.0.0.1"
NO_VISER = "live viewing needs viser, which is not installed: pip install 'retarget-bench[viz]'"
POLL = 2.0
"""Seconds after which results are looked at again."""
TICK = 1 / 60
BESIDE = 0.75
"""Heights between figures side by side, beyond the farthest reach of each."""
AWAY = 1.2
"""First distance of the camera, in radii of the figures."""
REACH = 6.0
"""Metres of a field of heights that are shown around the middle."""
CLEAR = 0.45
"""Opacity of a body with self-penetration."""
NOTHING_YET = "waiting for the first case"
FILES = "the files"


def viser() -> Any:
    """The module. Raises BenchError with what to do where it is not installed."""
    if find_spec("viser") is None:
        raise BenchError(NO_VISER)
    return importlib.import_module("viser")


@contextmanager
def _own_page_only() -> Iterator[None]:
    """A server started in here answers its own page alone, not pages of other sites, even where their name
    was pointed at this machine. Raises BenchError where viser starts its server in another way.
    """
    from websockets.asyncio import server

    serve, started = server.serve, False

    def guarded(*arguments: Any, process_request: Any, **options: Any) -> Any:
        nonlocal started
        started = True

        def first(connection: Any, request: Any) -> Any:
            port = connection.local_address[1]
            hosts = [f"{name}:{port}" for name in (HOST, "localhost")]
            if wrong := foreign(request.headers, hosts):
                return connection.respond(HTTPStatus.FORBIDDEN, f"{wrong}\n")
            return process_request(connection, request)

        return serve(*arguments, process_request=first, **options)

    server.serve = guarded  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
    if not started:
        raise BenchError("this version of viser cannot be kept from other pages; install viser 1.1")


def foreign(headers: Any, hosts: Sequence[str]) -> str:
    """Why a request is not of the page at one of these addresses, ``name:port``; "" where it is."""
    addresses, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(addresses) != 1 or addresses[0].lower() not in hosts:
        return f"this page is served at {hosts[0]} alone"
    # browsers always say where a page that opens a socket comes from
    if origins != [f"http://{addresses[0]}"] and (origins or headers.get_all("Upgrade")):
        return "another page asks"
    return ""


class Window:
    """A page on this machine's own address that shows a case of a list.

    port: 0 for any free one. Raises BenchError where the port is taken, or viser is not there.
    """

    def __init__(self, case_list: CaseList, port: int = 0, case: str | None = None) -> None:
        self.case_list = case_list
        self.scene: Scene | None = None
        self.frame = 0
        self._actors: list[Actor] = []
        self._others: list[Any] = []
        self._todo: list[Callable[[], None]] = []
        self._polled = 0.0
        with _own_page_only(), redirect_stdout(StringIO()):  # it greets with a banner
            self.server = viser().ViserServer(host=HOST, port=port, label="retarget-bench", verbose=False)
        self._build(self.server)
        self._cases: list[str] = []
        self.poll()
        if case is not None:
            self.choose(case)

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.server.get_port()}"

    # --------------------------------------------------------------------------------------- controls
    def _build(self, server: Any) -> None:
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        server.scene.set_up_direction("+y")
        gui = server.gui
        self.case = gui.add_dropdown("case", (NOTHING_YET,))
        self.play = gui.add_checkbox("play", True)
        self.at = gui.add_slider("frame", 0, 1, 1, 0)
        self.speed = gui.add_slider("speed", 0.1, 2.0, 0.1, 1.0)
        self.overlay = gui.add_checkbox("overlay", False)
        self.skin = gui.add_checkbox("skins", True, hint="meshes, where bodies have one")
        self.labels = gui.add_checkbox("names", True)
        self.said = gui.add_text("says", "", multiline=True, disabled=True)
        self.figures = gui.add_folder("figures")
        self._shown: dict[str, Any] = {}
        for handle in (self.overlay, self.skin):
            self._on(handle, self.rebuild)
        self._on(self.case, lambda: self.choose(self.case.value))
        self._on(self.labels, self.draw)
        self._on(self.at, lambda: self.seek(int(self.at.value)))

    def _on(self, handle: Any, action: Callable[[], None]) -> None:
        """Call a function, in the thread that draws, when a user changes a control."""
        handle.on_update(lambda event: self._todo.append(action) if event.client is not None else None)

    # --------------------------------------------------------------------------------------- what is shown
    def poll(self) -> None:
        """Refresh the list of cases; new ones appear among the choices."""
        self._polled = time.monotonic()
        cases = [plain(case) or FILES for case in self.case_list.refresh()]
        if cases == self._cases:
            return
        self._cases = cases
        self.case.options = tuple(cases) or (NOTHING_YET,)
        if self.scene is None and cases:
            self.choose(cases[0])

    def choose(self, case: str) -> None:
        """Show a case, from its beginning, or the reason why it cannot be shown."""
        if case == NOTHING_YET:
            return
        try:
            ids = {plain(each) or FILES: each for each in self.case_list.refresh()}
            self.scene = self.case_list.scene(ids.get(case, case))
        except BenchError as error:
            self.said.value = plain(str(error))
            return
        if self.case.value != case and case in self.case.options:
            self.case.value = case
        self.frame = 0
        self.at.max = max(self.scene.frames - 1, 1)
        self._list_figures(self.scene)
        self.rebuild()
        self._look_at_all()

    def _look_at_all(self) -> None:
        """Cameras go to where all figures are seen, from in front of them."""
        if not self._actors:
            return
        lead = self._actors[0].solid
        places = np.concatenate([(a.solid.places + a.shift).reshape(-1, 3) for a in self._actors])
        middle = (places.min(axis=0) + places.max(axis=0)) / 2
        turn = facing(lead.places[:1], lead.body)[0]
        way = np.array([turn.imag - 0.35 * turn.real, 0.35, turn.real + 0.35 * turn.imag])
        away = AWAY * float(np.linalg.norm(np.ptp(places, axis=0)) / 2 + 0.5)
        eye = middle + away * way / np.linalg.norm(way)
        cameras = [client.camera for client in self.server.get_clients().values()]
        for camera in (self.server.initial_camera, *cameras):
            camera.position, camera.look_at = tuple(eye), tuple(middle)

    def _list_figures(self, scene: Scene) -> None:
        """A box to tick for every figure; those of the same name keep theirs."""
        ticked = {label: box.value for label, box in self._shown.items()}
        for box in self._shown.values():
            box.remove()
        with self.figures:
            self._shown = {
                figure.label: self.server.gui.add_checkbox(
                    plain(figure.label), ticked.get(figure.label, True)
                )
                for figure in scene.figures
            }
        for box in self._shown.values():
            self._on(box, self.rebuild)

    def rebuild(self) -> None:
        """Put up the figures that are ticked, side by side or overlaid."""
        for thing in (*self._actors, *self._others):
            thing.remove()
        self._actors, self._others = [], []
        if self.scene is None:
            return
        if self.skin.value:
            self.scene = dressed(self.scene)
        scene = self.scene
        each = zip(scene.figures, colours(scene), strict=True)
        solids = [
            Solid(figure, colour, bool(self.skin.value))
            for figure, colour in each
            if figure.positions is not None and self._shown[figure.label].value
        ]
        shifts = beside(solids) if not self.overlay.value else np.zeros((len(solids), 3))
        self._actors = [
            Actor(self.server.scene, f"/figures/{number}", solid, shift)
            for number, (solid, shift) in enumerate(zip(solids, shifts, strict=True))
        ]
        self._others = self._stand_on(scene, solids)
        self.seek(self.frame)

    def _stand_on(self, scene: Scene, solids: Sequence[Solid]) -> list[Any]:
        """The floor: a grid, or a field of heights."""
        ground = scene.ground
        if ground.heights is None:
            return [
                self.server.scene.add_grid(
                    "/floor", plane="xz", infinite_grid=True, position=(0.0, float(ground.height), 0.0)
                )
            ]
        middle = solids[0].places[0, 0] if solids else np.zeros(3)
        tiles = floor.tiled(ground, np.array([middle[0], 0.0, middle[2]]), REACH)
        corners = np.arange(4 * len(tiles)).reshape(-1, 4)
        faces = np.concatenate([corners[:, [0, 3, 2]], corners[:, [0, 2, 1]]]).astype(np.uint32)
        points = tiles.reshape(-1, 3).astype(np.float32)
        return [
            self.server.scene.add_mesh_simple(
                "/floor", points, faces, color=FLOOR, flat_shading=True, side="double"
            )
        ]

    def seek(self, frame: int) -> None:
        """Show a frame, or the last one where there is none so late."""
        frame = min(frame, self.scene.frames - 1) if self.scene is not None else 0
        self.frame = frame
        if self.at.value != frame:
            self.at.value = frame
        self.draw()

    def draw(self) -> None:
        """Pose everything at the frame."""
        if self.scene is None:
            return
        with self.server.atomic():
            for actor in self._actors:
                actor.pose(self.frame, self.scene, bool(self.labels.value))
        words = frame_text(self.scene, self.frame, self.case_list.problem)
        if self.said.value != words:
            self.said.value = words

    # --------------------------------------------------------------------------------------- time
    def run(self) -> None:
        """Play until interrupted."""
        before, share = time.monotonic(), 0.0
        while True:
            now = time.monotonic()
            while self._todo:
                self._todo.pop(0)()
            if self.scene is not None and self.play.value:
                share += (now - before) * self.scene.fps * float(self.speed.value)
                if share >= 1.0:
                    self.seek((self.frame + int(share)) % self.scene.frames)
                    share %= 1.0
            before = now
            if now - self._polled > POLL:
                self.poll()
            time.sleep(TICK)

    def stop(self) -> None:
        with redirect_stdout(StringIO()):
            self.server.stop()


class Actor:
    """A figure in the scene of a page, as handles whose vertices are exchanged from frame to frame."""

    def __init__(self, stage: Any, name: str, solid: Solid, shift: np.ndarray) -> None:
        self.solid, self.shift = solid, shift
        self.model = Model(solid)
        first = self.model.vertices(0)
        self.parts = [
            stage.add_mesh_simple(
                f"{name}/{number}", points, part.faces, color=part.colour, position=tuple(shift)
            )
            for number, (part, points) in enumerate(zip(self.model.parts, first, strict=True))
        ]
        joints = solid.figure.joints or ()
        self.contacts = [
            stage.add_icosphere(
                f"{name}/contact-{joint}",
                radius=0.02 * solid.size,
                color=CONTACT,
                subdivisions=2,
                visible=False,
            )
            for joint in (joints if solid.figure.planted is not None else ())
        ]
        self.label = stage.add_label(f"{name}/label", plain(solid.figure.label), anchor="bottom-center")
        self.lit: list[Any] = []
        if solid.skinned and solid.figure.inside is not None and solid.figure.inside.any():
            points, face = solid.skin_at(0).astype(np.float32), np.zeros((1, 3), dtype=np.uint32)
            surface = stage.add_mesh_simple(
                f"{name}/lit", points, face, color=LIT, side="double", position=tuple(shift), visible=False
            )
            self.lit.append(surface)

    def pose(self, frame: int, scene: Scene, labelled: bool) -> None:
        """Move everything to where it is at a frame."""
        for part, points in zip(self.parts, self.model.vertices(frame), strict=True):
            part.vertices = points
        self._light(frame)
        figure, places = self.solid.figure, self.solid.places[frame]
        for number, ball in enumerate(self.contacts):
            assert figure.joints is not None
            assert figure.planted is not None
            place = places[figure.joints[number]]
            below = float(ground_height(scene.ground, place[0], place[2]))
            ball.visible = bool(figure.planted[frame, number])
            ball.position = tuple(self.shift + np.array([place[0], min(below, place[1]), place[2]]))
        top = places[:, 1].max() + 0.15 * self.solid.size
        middle = places.mean(axis=0)
        self.label.visible = labelled
        self.label.position = tuple(self.shift + np.array([middle[0], top, middle[2]]))

    def _light(self, frame: int) -> None:
        """Self-penetration at a frame, seen through the body."""
        for surface in self.lit:
            mesh, faces = self.solid.body.mesh, lit_faces(self.solid.figure, frame)
            assert mesh is not None
            surface.visible = bool(faces.any())
            for part in self.parts:
                part.opacity = CLEAR if surface.visible else None
            if surface.visible:
                surface.vertices = self.solid.skin_at(frame).astype(np.float32)
                surface.faces = mesh.faces[faces].astype(np.uint32)

    def remove(self) -> None:
        for handle in (*self.parts, *self.contacts, *self.lit, self.label):
            handle.remove()


def beside(solids: Sequence[Solid]) -> np.ndarray:
    """``(figures, 3)`` metres by which figures are moved so as to stand side by side, to their left in the
    order given, which is to the right of who looks at their faces."""
    if not solids:
        return np.zeros((0, 3))
    lead = solids[0]
    turn = facing(lead.places[:1], lead.body)[0]
    left = np.array([turn.real, 0.0, -turn.imag])  # forward is (imag, 0, real)
    shifts, last = np.zeros((len(solids), 3)), 0.0
    for number, solid in enumerate(solids):
        reach = (solid.places - solid.places[0, 0]) @ left
        if number:
            start = (solid.places[0, 0] - lead.places[0, 0]) @ left
            shifts[number] = (last - float(reach.min()) - start) * left
            last += float(np.ptp(reach)) + BESIDE * solid.size
        else:
            last = float(reach.max()) + BESIDE * solid.size
    return shifts


def frame_text(scene: Scene, frame: int, problem: str = "") -> str:
    """Time, errors and messages of a frame, line by line, as plain text."""
    lines = [f"{plain(scene.title)}: {frame / scene.fps:.2f} s"]
    for figure in scene.figures:
        notes = [figure.message] if figure.message else []
        if figure.positions is None:
            notes = [f"{figure.status}, {figure.message}"]
        elif figure.error is not None:
            now, mean = float(figure.error[frame]), float(np.nanmean(figure.error))
            notes.append(f"error {now:.1f} % of height (mean {mean:.1f})")
        if notes:
            lines.append(f"{plain(figure.label)}: {'; '.join(map(plain, notes))}")
    return "\n".join([*lines, *([plain(problem)] if problem else [])])
