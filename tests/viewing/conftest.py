"""A page with a player in it."""

from __future__ import annotations

import pytest
from acted import page, scene

from retarget_bench.viewer.scene import Scene


@pytest.fixture
def mounted(open_page, tmp_path):
    """``mounted(scene…, options=…, skins=…, **of the page)``: a page whose player of the first is ready."""

    def mount(*scenes: Scene, options: dict | None = None, skins: bool = False, **context):
        file = tmp_path / "a page.html"
        file.write_text(page(*(scenes or (scene(),)), options=options, skins=skins), encoding="utf-8")
        opened = open_page(file, **context)
        opened.evaluate("view.ready")
        return opened

    return mount
