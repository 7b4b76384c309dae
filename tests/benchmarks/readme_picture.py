"""The picture at the top of README.md: a report's player and table, as people see them.

    python tests/benchmarks/readme_picture.py [-o docs/pictures/report.png] [--results DIR]

Runs a few methods on the embedded motions between structures (or takes the results of ``--results``), makes
a report of them with ``bench report``, opens it in the system's Chromium, presses a number of the table,
shows all methods in one frame of a case, and cuts two pieces out of the page: the player down to its worst
frames, and the table. Nothing is drawn or moved by this script. Case and frame are fixed below.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "viewing")]

METHODS = ("copy_rotations", "ik", "pan", "smrm")
CONTROLS = ("reference", "rest_pose")
CASE = "puppets/hanna>grub/throw-001"
"""Two bodies of different build, limbs far from the trunk, and one method whose feet slide and sink."""
FRAME = 50
PRESSED = ("smrm", "mpjpe_h.world")
WINDOW = {"width": 1080, "height": 540}
SCALE = 1.3
GAP = 14
PAPER = (255, 255, 255)

PIECES = """
() => {
  const one = (what) => document.querySelector(what);
  const box = (each) => each.getBoundingClientRect();
  const table = one("table.results[data-split=cross]");
  const sides = (heads, edge) => heads.map((each) => box(each).right).filter((right) => right <= edge + 1);
  const cut = (first, last, left, right) => ({
    x: left + scrollX, y: box(first).top + scrollY,
    width: right - left, height: box(last).bottom - box(first).top });
  const player = box(one("#player"));
  const whole = sides([...table.tHead.rows[0].cells], box(table.parentNode).right); // columns
  return [
    cut(one("#caption"), one(".rp-worst"), player.left, player.right),
    cut(table.parentNode.previousElementSibling, table, box(table).left, Math.max(...whole))];
}
"""


def bench(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "retarget_bench", *map(str, words)], cwd=ROOT, check=True)


def reported(results: Path | None, folder: Path) -> Path:
    """The report, of results that are there or of a run made for it."""
    shown = METHODS + CONTROLS
    if results is None:
        results = folder / "runs"
        bench("run", *shown, "-s", "cross", "--out", results)
    page = folder / "report.html"
    chosen = [word for method in shown for word in ("-m", method)]
    bench("report", results, "-o", page, "--clips", 0, "--case", CASE, *chosen)
    return page


def pieces(page: Path) -> list[Image.Image]:
    """Player and table of the report, cut out of one state of the page."""
    from browser import found
    from playwright.sync_api import sync_playwright

    program = found()
    if program is None:
        sys.exit("No Chromium is here: install one, or name it by $CHROMIUM.")
    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=program, args=["--no-sandbox"])
        opened = browser.new_page(
            viewport=WINDOW, device_scale_factor=SCALE, color_scheme="light", reduced_motion="reduce"
        )
        opened.set_default_timeout(120_000)
        opened.goto(page.as_uri())
        opened.wait_for_selector("#player canvas")
        arranged(opened)
        cuts = [opened.screenshot(full_page=True, clip=clip) for clip in opened.evaluate(PIECES)]
        browser.close()
    return [Image.open(BytesIO(cut)).convert("RGB") for cut in cuts]


def arranged(opened) -> None:
    """A number is pressed, every method is shown, and time stands at ``FRAME``."""
    method, column = PRESSED
    table = opened.locator("table.results[data-split=cross]").first
    place = table.locator(f"thead th[data-column='{column}']")
    rank = place.evaluate("each => each.cellIndex")
    row = table.locator(f"tbody tr[data-row='{method}']")
    row.locator(":scope > *").nth(rank).locator(".num").click()
    opened.wait_for_selector("#player canvas")
    for name in METHODS:
        opened.locator(".rp-chip").filter(has_text=name).locator("input").check()
    opened.locator("#player input[type=range]").fill(str(FRAME))
    opened.mouse.move(0, 0)
    opened.evaluate("document.activeElement.blur()")
    opened.wait_for_timeout(500)  # drawn by then


def joined(parts: list[Image.Image]) -> Image.Image:
    """One above the other, with a margin."""
    height = sum(part.height + GAP for part in parts) + GAP
    made = Image.new("RGB", (max(part.width for part in parts) + 2 * GAP, height), PAPER)
    top = GAP
    for part in parts:
        made.paste(part, (GAP, top))
        top += part.height + GAP
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "pictures" / "report.png")
    parser.add_argument("--results", type=Path, help="results of an earlier run, with the methods shown")
    asked = parser.parse_args()
    with TemporaryDirectory() as folder:
        page = reported(asked.results and asked.results.resolve(), Path(folder))
        made = joined(pieces(page))
    asked.output.parent.mkdir(parents=True, exist_ok=True)
    made.save(asked.output, optimize=True)
    print(f"{asked.output}: {made.width} x {made.height}, {asked.output.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
