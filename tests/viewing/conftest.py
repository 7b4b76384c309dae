"""A page with a player in it."""

from __future__ import annotations

import pytest
from acted import page, scene

from retarget_bench.viewing.scene import Scene


@pytest.fixture
def mounted(open_page, tmp_path):
    """``mounted(scene…, options=…, **of the page)``: a page whose player of the first scene is ready."""

    def made(*scenes: Scene, options: dict | None = None, **context):
        file = tmp_path / "a page.html"
        file.write_text(page(*(scenes or (scene(),)), options=options), encoding="utf-8")
        opened = open_page(file, **context)
        opened.evaluate("view.ready")
        return opened

    return made
