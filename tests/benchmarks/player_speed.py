"""What the player in pages costs: milliseconds per drawn picture of eight figures, and bytes per scene.

Run it with ``python tests/benchmarks/player_speed.py``, and ``--sizes`` or ``--speed`` for one half. Scenes
are of puppets (default size), answered by eight methods that need no weights; the clips are spread evenly
over the cross-structural cases. Pictures are drawn in the system's Chromium without a graphics card, on
1200 x 560 pixels: what the page's main thread computed (script and drawing, so that other programs do not
count), and what the script alone took on the clock; each as a share of the 16.7 ms that a screen of 60 Hz
leaves.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from tqdm import tqdm

from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.viewer import player
from retarget_bench.viewer.packing import packed
from retarget_bench.viewer.scene import Scene
from retarget_bench.viewer.scene_builder import of_case_asked

sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1] / "viewing")]

PUPPETS = Spec.parse("puppets[size=default]")
METHODS = [
    Spec.parse(method + post)
    for method in ("copy_rotations", "bone_directions", "ik", "ik[hands=false]")
    for post in ("", "+footfix")
]
CLIPS, LIMIT_MB = 20, 12.0
BUDGET = 1000.0 / 60.0
SECONDS = 6.0
MODES = {
    "side by side": (),
    "overlaid": ("Overlay",),
    "with ghosts, heat and trails": ("Ghost", "Heat", "Trails"),
    "with skins": ("Skins",),
}
COUNTED = """
const asked = window.requestAnimationFrame.bind(window);
window.drawn = [];
window.requestAnimationFrame = (action) => asked((now) => {
  const begun = performance.now();
  action(now);
  window.drawn.push(performance.now() - begun);
});
"""


def scenes() -> list[Scene]:
    infos = bound.dataset(PUPPETS).built.cases("retarget", "cross")
    chosen = infos[:: len(infos) // CLIPS][:CLIPS]
    return [
        of_case_asked(PUPPETS, "cross", info.id, METHODS) for info in tqdm(chosen, "clips", disable=None)
    ]


def sizes(made: list[Scene]) -> None:
    held = [len(player.data(packed(scene))) for scene in made]
    clad = [packed(scene, skins=True) for scene in made]
    figures = sum(len(scene.figures) * scene.frames for scene in made)
    code = len(player.script()) + len(player.style())
    total = (sum(held) + code) / 1e6
    longest = max(scene.frames for scene in made)
    print(
        f"{len(made)} clips x {len(METHODS)} methods, {figures} frames of figures, longest clip {longest}: "
        f"{total:.2f} MB of {LIMIT_MB:.0f} ({total / LIMIT_MB:.1%}); {sum(held) / figures:.1f} bytes per "
        f"figure and frame, {code / 1000:.0f} kB of script and style"
    )
    more = sum(len(player.data(each)) for each in clad) - sum(held)
    faces = [body["skin"]["faces"] for each in clad for body in each["bodies"] if "skin" in body]
    worn = sum(figure["skin"] for each in clad for figure in each["figures"])
    print(
        f"with skins: {len(faces)} of up to {max(faces)} triangles, worn by {worn} figures: "
        f"{(sum(held) + code + more) / 1e6:.2f} MB ({(sum(held) + code + more) / 1e6 / LIMIT_MB:.1%})"
    )


def speed(scene: Scene) -> None:
    """The scene shall have eight figures."""
    from acted import page
    from browser import found
    from playwright.sync_api import sync_playwright

    with TemporaryDirectory() as folder, sync_playwright() as running:
        file = Path(folder) / "page.html"
        file.write_text(page(scene, skins=True), encoding="utf-8")
        chromium = running.chromium.launch(executable_path=found(), args=["--no-sandbox"])
        joints = sum(len(figure.character.skeleton) for figure in scene.figures)
        print(f"{len(scene.figures)} figures, {joints} joints; budget {BUDGET:.1f} ms")
        for mode, buttons in MODES.items():
            opened = chromium.new_page(viewport={"width": 1218, "height": 903})
            opened.add_init_script(COUNTED)
            opened.goto(file.as_uri())
            opened.evaluate("view.ready")
            for name in buttons:
                opened.get_by_role("button", name=name, exact=True).click()
            print(f"  {mode:<30}{told(opened)}")
            opened.close()
        chromium.close()


def told(opened) -> str:
    session = opened.context.new_cdp_session(opened)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    opened.get_by_role("button", name="Play", exact=True).click()
    opened.wait_for_timeout(1000)
    before, first = computed(session), opened.evaluate("drawn.length")
    opened.wait_for_timeout(1000 * SECONDS)
    after, drawn = computed(session), opened.evaluate("drawn")[first:]
    each = 1000 * (after - before) / len(drawn)
    clock = median(drawn)
    return (
        f"{each:5.1f} ms computed ({each / BUDGET:.2f} of the budget), script alone {clock:.1f} ms on the "
        f"clock ({clock / BUDGET:.2f}), {len(drawn) / SECONDS:.0f} pictures a second"
    )


def computed(session) -> float:
    """Seconds that the page's main thread has computed, its drawing included."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(each["value"] for each in metrics if each["name"] == "TaskDuration")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", action="store_true")
    parser.add_argument("--speed", action="store_true")
    asked = parser.parse_args()
    if asked.sizes or not asked.speed:
        sizes(scenes())
    if asked.speed or not asked.sizes:
        info = next(
            each for each in bound.dataset(PUPPETS).built.cases("retarget", "cross") if each.kind == "walk"
        )
        speed(of_case_asked(PUPPETS, "cross", info.id, METHODS[:6]))


if __name__ == "__main__":
    main()
