"""The live view: a page with the player on this machine's own address, which asks for what it shows."""

from __future__ import annotations

import json
import sys
from functools import lru_cache
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock
from typing import Any
from urllib.parse import parse_qs, urlsplit

from retarget_bench.errors import BenchError
from retarget_bench.viewer import packing, player
from retarget_bench.viewer.scene import Scene
from retarget_bench.viewer.scene_builder import CaseList, dressed
from retarget_bench.viewer.skins import LIVE

HOST = "127.0.0.1"
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}
"""Of every answer: no other page may show or read it."""


class Window(ThreadingHTTPServer):
    """The server of a page that shows a case of a list. Nothing is computed but what the page asks for.

    ``/cases`` lists them, ``/scene?case=ID`` is one packed, ``/inside?case=ID&figure=0&frame=12`` the
    corners of a skin that are inside its body, and ``/state`` a text that changes when results or files do.
    case: the first that is shown. port: 0 for any free one; raises OSError where it is taken.
    """

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, case_list: CaseList, port: int = 0, case: str | None = None) -> None:
        super().__init__((HOST, port), _Asked)
        self.case_list = case_list
        self._first = case
        self._working = Lock()
        self._scene = lru_cache(maxsize=4)(self._packable)

    def check(self) -> None:
        """The scene of files, which the page asks for first. Raises BenchError where they have none."""
        if self.case_list.files:
            self._scene("", self.case_list.state_of(""))

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.server_port}"

    def answer(self, path: str, query: dict[str, str]) -> Any:
        """What the page asks for, for ``json.dumps``; None: there is no such thing. Raises BenchError."""
        with self._working:
            listed, case = self.case_list, query.get("case", "")
            if path == "/state":
                return listed.state()
            if path == "/cases":
                state, cases = listed.state(), {each: listed.state_of(each) for each in listed.refresh()}
                return {"cases": cases, "first": self._first, "problem": listed.problem, "state": state}
            if path not in ("/scene", "/inside"):
                return None
            scene = self._scene(case, listed.state_of(case))
            if path == "/scene":
                return packing.packed(scene, LIVE)
            figure, frame = _number(query, "figure"), _number(query, "frame")
            there = 0 <= figure < len(scene.figures) and 0 <= frame < scene.frames
            return packing.inside_at(scene.figures[figure], frame, LIVE) if there else None

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that went away in the middle is no error of anybody's."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            super().handle_error(request, client_address)

    def _packable(self, case: str, state: str) -> Scene:
        del state  # what it was made of
        self.case_list.refresh()
        return dressed(self.case_list.scene(case))


class _Asked(BaseHTTPRequestHandler):
    """One request; only this page's own are answered, even where another name points at this machine."""

    server: Window
    timeout = 30

    def do_GET(self) -> None:
        port = self.server.server_port
        if wrong := foreign(self.headers, [f"{name}:{port}" for name in (HOST, "localhost")]):
            self._send(HTTPStatus.FORBIDDEN, wrong)
            return
        try:
            asked = urlsplit(self.path)
            query = {key: values[-1] for key, values in parse_qs(asked.query).items()}
        except ValueError:
            self._send(HTTPStatus.BAD_REQUEST, "no address")
            return
        if asked.path == "/":
            self._send(HTTPStatus.OK, player.live_page(), "text/html")
            return
        try:
            found = self.server.answer(asked.path, query)
        except BenchError as error:
            self._send(HTTPStatus.CONFLICT, str(error))
        else:
            known = found is not None
            status = HTTPStatus.OK if known else HTTPStatus.NOT_FOUND
            self._send(status, json.dumps(found), "application/json")

    def _send(self, status: HTTPStatus, text: str, kind: str = "text/plain") -> None:
        content = text.encode()
        self.send_response(status)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is for what people asked."""


def _number(query: dict[str, str], name: str) -> int:
    """A whole number that is asked for; -1 where none is."""
    text = query.get(name, "")
    return int(text) if text.isdecimal() and len(text) < 10 else -1


def foreign(headers: Any, hosts: list[str]) -> str:
    """Why a request is not of the page at one of these addresses, ``name:port``; "" where it is."""
    addresses, origins = headers.get_all("Host", []), headers.get_all("Origin", [])
    if len(addresses) != 1 or addresses[0].lower() not in hosts:
        return f"this page is served at {hosts[0]} alone"
    # browsers always say so where another page asks, and leave Origin out where this one does
    sites = headers.get_all("Sec-Fetch-Site", [])
    if any(each != f"http://{addresses[0]}" for each in origins) or {*sites} - {"same-origin", "none"}:
        return "another page asks"
    return ""
