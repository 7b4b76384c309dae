"""How fast frames are drawn: ``bench render``'s pictures against matplotlib's FuncAnimation, in one run.

Run it with ``python tests/benchmarks/render_speed.py``. Both draw a case of puppets, answered by two
methods that need no weights: four figures side by side on 1280 x 720 pixels. matplotlib draws what people
usually draw with it: a three-dimensional axis per figure with a line per bone, moved by ``set_data_3d``,
without shading, floor or contacts, on its fastest canvas (Agg). Both give RGB pixels in memory; nothing is
encoded. Rounds of the two alternate, processor time counts, and medians of frames per second and of their
ratio are printed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from statistics import median

import matplotlib as mpl
import numpy as np
from matplotlib import animation, pyplot

from retarget_bench.api import TASKS
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.viewer.drawing import Drawing, DrawingStyle
from retarget_bench.viewer.scene import Scene
from retarget_bench.viewer.scene_builder import of_case_asked

PUPPETS = Spec.parse("puppets[size=tiny]")
METHODS = [Spec("copy_rotations"), Spec("ik")]
SIZE = (1280, 720)
FRAMES, ROUNDS = 20, 5


class Frames(animation.AbstractMovieWriter):
    """A writer that takes every frame's pixels and keeps none."""

    def __init__(self) -> None:
        super().__init__(fps=30)
        self.frames = 0

    def setup(self, fig, outfile, dpi=None) -> None:
        self.fig = fig

    def grab_frame(self, **kwargs) -> None:
        self.fig.canvas.draw()
        assert np.asarray(self.fig.canvas.buffer_rgba()).shape == (SIZE[1], SIZE[0], 4)
        self.frames += 1

    def finish(self) -> None:
        pass


def of_matplotlib(scene: Scene, frames: int) -> Callable[[], None]:
    """Something that draws so many frames when it is called."""
    figure = pyplot.figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100)
    lines = []
    for number, shown in enumerate(scene.figures):
        axis = figure.add_subplot(1, len(scene.figures), number + 1, projection="3d")
        low, high = shown.positions.min(axis=(0, 1)), shown.positions.max(axis=(0, 1))
        axis.set(xlim=(low[0], high[0]), ylim=(low[2], high[2]), zlim=(low[1], high[1]), title=shown.label)
        axis.set_box_aspect(np.maximum((high - low)[[0, 2, 1]], 0.1))
        for joint, parent in enumerate(shown.parents.tolist()):
            if parent >= 0:
                (line,) = axis.plot([], [], [], lw=3)
                lines.append((line, shown.positions[:, [parent, joint]]))

    def update(frame: int) -> list:
        for line, bone in lines:
            line.set_data_3d(bone[frame, :, 0], bone[frame, :, 2], bone[frame, :, 1])
        return [line for line, _ in lines]

    def draw() -> None:
        moving = animation.FuncAnimation(
            figure, update, frames=frames, init_func=list, cache_frame_data=False
        )
        writer = Frames()
        moving.save("unused", writer=writer)
        assert writer.frames == frames

    return draw


def of_ours(scene: Scene, frames: int, **look: bool) -> Callable[[], None]:
    picture = Drawing(scene, DrawingStyle(SIZE, **look))

    def draw() -> None:
        for frame in range(frames):
            assert picture.at(frame).size == SIZE

    return draw


def rates(scene: Scene, frames: int, rounds: int) -> Iterator[dict[str, float]]:
    """Frames per second of processor time, by who drew them, round by round."""
    ways = {
        "matplotlib": of_matplotlib(scene, frames),
        "bench render": of_ours(scene, frames),
        "bench render --overlay": of_ours(scene, frames, overlay=True),
        "bench render --skin": of_ours(scene, frames, skin=True),
    }
    for draw in ways.values():
        draw()
    for _ in range(rounds):
        found = {}
        for name, draw in ways.items():
            begun = time.process_time()
            draw()
            found[name] = frames / (time.process_time() - begun)
        yield found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    given = parser.parse_args()
    mpl.use("agg")
    data = bound.dataset(PUPPETS).built
    info = next(each for each in data.cases(TASKS[0], "cross") if each.kind == "run")
    scene = of_case_asked(PUPPETS, "cross", info.id, METHODS)
    found = list(rates(scene, given.frames, given.rounds))
    print(f"{info.id}: {len(scene.figures)} figures, {SIZE[0]} x {SIZE[1]} pixels, one thread")
    for name in found[0]:
        speed = median(each[name] for each in found)
        ratio = median(each[name] / each["matplotlib"] for each in found)
        print(f"{name:24} {speed:6.1f} frames per second, {ratio:5.1f} x matplotlib")


if __name__ == "__main__":
    main()
