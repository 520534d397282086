"""Who may talk to the page: the browser that opened the printed address, and nobody else.

The server listens on 127.0.0.1, which every program and every web page of this machine's browser can reach. Hence:

- Host must be this address, so that a foreign name that resolves to 127.0.0.1 (DNS rebinding) is refused;
- Origin, where a browser sends one, must be this page's;
- the page, its session and its connection need the token of the printed address, which differs from run to run, and
  which a browser that is opened gets from a file of this user;
- at most :data:`PAGES` pages are connected at a time.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aiohttp import web

HOST = "127.0.0.1"
PAGES = 8
"""Most pages that are connected at a time."""
GUARDED = ("/", "/index.html", "/ws")
"""Paths that need the token, beside the session; all others are scripts of the page, which hold nothing of a user's."""
HEADERS = {
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
    # the page's own template is compiled in the browser, hence unsafe-eval; nothing is loaded from another host
    "Content-Security-Policy": "default-src 'self' blob: data: 'unsafe-inline' 'unsafe-eval'; frame-ancestors 'none'",
}
OPEN_THE_ADDRESS = "Open the address that notchbend app printed: it ends in ?token= and letters that only it knows.\n"

Handler = Callable[[Any], Awaitable[Any]]


class Guard:
    """Checks of one server, and how many pages are connected to it."""

    def __init__(self) -> None:
        self.token = secrets.token_hex(24)  # lower case: the page turns the address of its connection into it
        self.secret = secrets.token_hex(16)
        """Of the connection, unknown to other pages of the browser."""
        self.pages = 0

    def address(self, port: int) -> str:
        """Give the address to open."""
        return f"http://{HOST}:{port}/?token={self.token}"

    def redirect(self, port: int, folder: Path) -> Path:
        """Write a file that leads a browser to the address: all users can read its command line, but not the file."""
        path = folder / "open.html"
        path.touch(mode=0o600)
        path.write_text(f'<meta http-equiv="refresh" content="0;url={self.address(port)}">\n', encoding="utf-8")
        return path

    def knows(self, token: object) -> bool:
        """Whether this is the token, in a time that does not depend on where it differs."""
        return isinstance(token, str) and secrets.compare_digest(token.encode(), self.token.encode())

    def protect(self, app: web.Application) -> None:
        """Put the checks before every route of a server, and answer its page's request for a session."""
        from aiohttp import web

        @web.middleware
        async def check(request: web.Request, handler: Handler) -> Any:
            if (refused := self.refusal(request)) is not None:
                return web.Response(status=refused[0], text=refused[1], headers=HEADERS)
            if request.path == "/ws":
                return await self._connected(request, handler)
            try:
                answer = await handler(request)
            except web.HTTPException as other:
                other.headers.update(HEADERS)
                raise
            answer.headers.update(HEADERS)
            return answer

        async def session(request: web.Request) -> web.Response:
            try:
                asked = await request.json()  # with the parameters of the page's address
            except ValueError:
                asked = None
            if not isinstance(asked, dict) or not self.knows(asked.get("token")):
                return web.Response(status=403, text=OPEN_THE_ADDRESS)
            return web.json_response({"sessionURL": f"ws://USE_HOST/ws?token={self.token}", "secret": self.secret})

        app.middlewares.append(check)
        app.router.add_post("/paraview/", session)

    def refusal(self, request: web.Request) -> tuple[int, str] | None:
        """Give status and words for a request that is refused; None for one that is answered."""
        port = request.transport.get_extra_info("sockname")[1] if request.transport else 0
        hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        if request.headers.get("Host") not in hosts:
            return 403, f"Host: expected {HOST}:{port}\n"
        origin = request.headers.get("Origin")
        if origin is not None and origin not in {f"http://{host}" for host in hosts}:
            return 403, f"Origin: expected http://{HOST}:{port}\n"
        if request.path in GUARDED:
            if not self.knows(request.query.get("token")):
                return 403, OPEN_THE_ADDRESS
            if self.pages >= PAGES:
                return 503, f"{self.pages} pages are open, which is the limit. Close one and load this page again.\n"
        return None

    async def _connected(self, request: web.Request, handler: Handler) -> Any:
        self.pages += 1
        try:
            return await handler(request)
        finally:
            self.pages -= 1
