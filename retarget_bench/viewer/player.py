"""The player of pages: script, style, and packed scenes."""

import html
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

PAGES = Path(__file__).parent / "pages"
PARTS = (
    "packed", "camera", "bodies", "raster", "skins", "floor", "faults",
    "titles", "stage", "timeline", "controls", "input", "mount",
)  # fmt: skip
"""The files of the script, in the order in which they stand in one."""

FRAMED = """const fit = () => {
  if (frameElement) frameElement.style.height = `${document.body.offsetHeight}px`;
};
new ResizeObserver(fit).observe(document.body);"""
"""A frame around the page, as in a notebook, is made as high as the player."""


@cache
def script() -> str:
    """One script without dependencies that defines ``RetargetPlayer`` and nothing else.

    ``RetargetPlayer.mount(element, packedScene, options)`` puts a player into an element and returns
    ``{ready, seek(frame), select(labels), state(), destroy()}``; ``ready`` is a promise of the first
    picture. Options, all optional: ``frame`` (from 0), ``labels`` (the figures to show), ``colours``
    (label -> ``#rrggbb``), ``overlay``, ``skins``, ``autoplay`` (never where people asked for less
    motion), ``state`` (of a player that this one goes on for) and ``inside`` (figure, frame -> a promise
    of the corners of its skin that are inside the body).
    ``decode(packedScene)``, ``floorAt(ground, x, z)`` and, for figures with skins, ``surfaceAt(figure,
    frame, frames)`` are what it reads scenes with.
    """
    parts = [(PAGES / "player" / f"{name}.js").read_text(encoding="utf-8") for name in PARTS]
    body = "\n".join(parts)
    result = "return { mount, decode, floorAt, surfaceAt };"
    return f'var RetargetPlayer = (() => {{\n"use strict";\n{body}\n{result}\n}})();\n'


@cache
def style() -> str:
    """The player's style sheet: every rule is below ``.rp``."""
    return (PAGES / "player.css").read_text(encoding="utf-8")


def page(packed: Mapping[str, Any], options: Mapping[str, Any]) -> str:
    """A page with a player of one packed scene and nothing else. options: of ``mount``."""
    title = html.escape(str(packed["title"]))
    begin = 'RetargetPlayer.mount(document.getElementById("player"), scene, options);\n' + FRAMED
    read = 'JSON.parse(document.getElementById("%s").textContent)'
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="color-scheme" content="light dark">\n<title>{title}</title>\n'
        f"<style>body {{ margin: 0; }}\n{style()}</style></head>\n"
        '<body><div id="player"></div>\n'
        f'<script type="application/json" id="scene">{data(packed)}</script>\n'
        f'<script type="application/json" id="options">{data(options)}</script>\n'
        f"<script>{script()}\n"
        f"const scene = {read % 'scene'}, options = {read % 'options'};\n{begin}</script>\n</body></html>\n"
    )


@cache
def live_page() -> str:
    """The page of the live view, which asks its server for scenes."""
    page = (PAGES / "live.html").read_text(encoding="utf-8")
    own = (PAGES / "live.js").read_text(encoding="utf-8")
    parts = {"style": style(), "player": script(), "script": own}
    for name, text in parts.items():
        page = page.replace(f"{{{name}}}", text)
    return page


def data(packed: Mapping[str, Any]) -> str:
    """A packed scene as text of an element ``<script type="application/json">``, which no name can end."""
    text = json.dumps(packed, allow_nan=False, separators=(",", ":"))
    for unsafe in "<>&":
        text = text.replace(unsafe, f"\\u{ord(unsafe):04x}")
    return text
