"""A browser for tests of pages: the system's own Chromium, without a network, strict about errors."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")


def found() -> str | None:
    """The program: ``$CHROMIUM``, else the first of ``NAMES`` on the path."""
    asked = os.environ.get("CHROMIUM")
    return asked or next((path for name in NAMES if (path := shutil.which(name))), None)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless browser, started once; tests that ask for it are skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="pages are tested with playwright")
    program = found()
    if program is None:
        pytest.skip(f"pages are tested in a browser: none of {', '.join(NAMES)} is here, nor $CHROMIUM set")
    rootless = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with playwright.sync_playwright() as running:
        opened = running.chromium.launch(executable_path=program, args=rootless)
        yield opened
        opened.close()


@pytest.fixture
def open_page(browser) -> Iterator[Callable[..., Any]]:
    """``open_page(file, width=1000, height=800, **context)``: a file as those see it who open it from disk.

    When the test ends, it fails if a page wrote to the console, raised an error, or asked for anything but
    itself. context: of Playwright's ``new_context`` (``color_scheme``, ``has_touch``, ``reduced_motion``).
    """
    contexts, said, asked = [], [], []

    def opened(file: Path, width: int = 1000, height: int = 800, **context: Any) -> Any:
        contexts.append(
            browser.new_context(offline=True, viewport={"width": width, "height": height}, **context)
        )
        page = contexts[-1].new_page()
        page.set_default_timeout(60_000)  # of machines that do much else
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(file.as_uri())
        return page

    yield opened
    for context in contexts:
        context.close()
    assert not said, said
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []
    assert len(asked) == len(contexts), asked
