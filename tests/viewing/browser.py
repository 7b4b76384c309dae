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
    program = os.environ.get("CHROMIUM")
    return program or next((path for name in NAMES if (path := shutil.which(name))), None)


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


class Tab:
    """A page of its own context, and what it wrote to the console and asked for since it was cleared."""

    def __init__(self, browser: Any, context: dict[str, Any]) -> None:
        self.page = browser.new_context(offline=True, **context).new_page()
        self.page.set_default_timeout(60_000)  # of machines that do much else
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))

    def clear(self) -> tuple[list[str], list[str]]:
        """Leave the page, so that nothing of it goes on; what it said and asked for."""
        self.page.goto("about:blank")
        self.page.mouse.move(0, 0)
        record = [*self.said], [url for url in self.asked if url != "about:blank"]
        self.said.clear()
        self.asked.clear()
        return record


@pytest.fixture(scope="module")
def tabs(browser) -> Iterator[dict[str, list[Tab]]]:
    """Tabs of a module by the options of their contexts: a new context takes longer than a page."""
    opened: dict[str, list[Tab]] = {}
    yield opened
    for tab in (tab for same in opened.values() for tab in same):
        tab.page.context.close()


@pytest.fixture
def open_page(browser, tabs) -> Iterator[Callable[..., Any]]:
    """``open_page(file, width=1000, height=800, **context)``: a file as those see it who open it from disk.

    When the test ends, it fails if a page wrote to the console, raised an error, or asked for anything but
    itself. context: of Playwright's ``new_context`` (``color_scheme``, ``has_touch``, ``reduced_motion``).
    """
    used: list[Tab] = []

    def opened(file: Path, width: int = 1000, height: int = 800, **context: Any) -> Any:
        same = tabs.setdefault(repr(sorted(context.items())), [])
        tab = next((tab for tab in same if tab not in used), None)
        if tab is None:
            tab = Tab(browser, context)
            same.append(tab)
        used.append(tab)
        tab.page.set_viewport_size({"width": width, "height": height})
        tab.page.goto(file.as_uri())
        return tab.page

    yield opened
    records = [tab.clear() for tab in used]
    assert [text for messages, _ in records for text in messages] == []
    requests = [url for _, requests in records for url in requests]
    assert [url for url in requests if not url.startswith(("file:", "blob:", "data:"))] == []
    assert len(requests) == len(used), requests
