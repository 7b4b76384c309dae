"""FBX files read in copies of this process."""

from __future__ import annotations

import importlib
import os

import pytest


@pytest.fixture
def forked(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """FBX files are read in copies of this process: one of its own takes much longer to start."""
    if hasattr(os, "fork") and not request.node.get_closest_marker("processes"):
        monkeypatch.setattr(
            "retarget_bench.motion.files.fbx.content.process",
            lambda *arguments: importlib.import_module("fbx_fork").process(*arguments),
        )
