"""Web server of `hapteq serve`: the application in a browser by textual-serve, in a single window at a time.

The page drives a device, and a server bound to localhost can still be reached by any website that is open in a browser
of this machine, and by any local account. So the address contains a random token, without which every request is
refused (downloads excepted, whose random key is used once); the Origin header of the WebSocket connection is checked;
and headers (content security policy, no framing) keep other pages away.
"""

import asyncio
import base64
import contextlib
import hashlib
import hmac
import logging
import re
import secrets
import shlex
from collections.abc import Awaitable, Callable, Iterator, Sequence

from aiohttp import web
from rich.console import Console
from textual_serve.app_service import AppService
from textual_serve.server import Server, to_int

RELOAD_TIMEOUT_S = 10.0
"""Longest time (s) for which a reloaded page waits until the application of the previous page has ended. Chosen: longer
than the end of an application usually takes; after it, another window is assumed to be open."""

SILENCE_S = 6.0
"""Time (s) after which a silent browser counts as gone, which ends the application and its force. Chosen: longer than a
network or a busy computer stalls."""
PING_S = 2.0
"""Time (s) between two requests for a sign of life; a connection may stall for `SILENCE_S` less this time."""

LOCAL_HOST_NAMES = ("localhost", "127.0.0.1", "[::1]")
"""Names by which a browser may address this machine."""
TOKEN_BYTES = 32
"""Number of random bytes of the token: 256 bits, too many to guess."""


class ScreenServer(Server):
    """Server that starts `command` for the page, at most once at a time; closing the page ends it, as closing a
    terminal would. host, port: address to listen on. print_line: prints a line for the user."""

    def __init__(self, command: Sequence[str], host: str, port: int, print_line: Callable[[str], None]) -> None:
        super().__init__(
            shlex.join(command),
            host=host,
            port=port,
            title="hapteq study",
            public_url=_format_origin(_format_url_host(host), port),
        )
        self.console = Console(stderr=True)
        self._print_line = print_line
        self._allowed_origins = list_origins(host, port)
        self._token = secrets.token_urlsafe(TOKEN_BYTES)
        self._security_headers = self._make_security_headers()
        self._window_lock = asyncio.Lock()
        self._downloads_in_progress: set[str] = set()

    def initialize_logging(self) -> None:
        """Log from warnings on: a log of requests would hide important lines and show the token."""
        logging.basicConfig(level=logging.WARNING, format="%(message)s")
        logging.getLogger("aiohttp.access").disabled = True

    async def on_startup(self, app: web.Application) -> None:
        self._print_line(f"The study is at {self.public_url}/{self._token}/ for one window at a time. Ctrl-C ends it.")
        self._print_line(
            "Keep this address to yourself: any browser that has it can take the study. It changes each time."
        )

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        """Run the application for the page that opens this connection, until either ends. Raises HTTPForbidden for
        another origin or none, and HTTPConflict where another window is still open after `RELOAD_TIMEOUT_S`."""
        if request.headers.get("Origin") not in self._allowed_origins:
            raise web.HTTPForbidden(text="Only the page of this server may drive the device.")
        try:
            async with asyncio.timeout(RELOAD_TIMEOUT_S):
                await self._window_lock.acquire()
        except TimeoutError:
            raise web.HTTPConflict(text="The study is open in another window.") from None
        try:
            return await self._run_application(request)
        finally:
            self._window_lock.release()

    async def _run_application(self, request: web.Request) -> web.WebSocketResponse:
        """Run the application until it or the connection ends, as `Server.handle_websocket` does, whose heartbeat of
        15 s would leave a force on for 23 s after the browser's machine fell silent."""
        websocket = web.WebSocketResponse(receive_timeout=SILENCE_S)
        await websocket.prepare(request)

        async def send_output(output: bytes) -> None:
            """Send output of the application; drop it from the end of the connection on, so that the application, whose
            output is read until it ends, neither stops at a full pipe nor outlives the lock."""
            with contextlib.suppress(ConnectionError):
                await websocket.send_bytes(output)

        async def close_connection() -> None:
            """Close the connection, when the application ends."""
            await websocket.close()

        application = AppService(
            self.command,
            write_bytes=send_output,
            write_str=websocket.send_str,
            close=close_connection,
            download_manager=self.download_manager,
            debug=self.debug,
        )
        ping_task = asyncio.create_task(_send_pings(websocket))
        try:
            await application.start(
                to_int(request.query.get("width", ""), 80), to_int(request.query.get("height", ""), 24)
            )
            await self._process_messages(websocket, application)
        except TimeoutError:
            if request.transport is not None:
                request.transport.abort()  # output that a silent browser does not take would be waited for
        except Exception:
            logging.getLogger(__name__).exception("The connection of the page failed")
        finally:
            ping_task.cancel()
            await application.stop()
        return websocket

    async def handle_download(self, request: web.Request) -> web.StreamResponse:
        """Send a file to the first request only: two requests would each receive a part of it. Raises HTTPConflict for
        another method than GET, and while the file is being sent."""
        key = request.match_info["key"]
        if request.method != "GET" or key in self._downloads_in_progress:
            raise web.HTTPConflict(text="This report is sent once, and to one window.")
        self._downloads_in_progress.add(key)
        try:
            return await super().handle_download(request)
        finally:
            self._downloads_in_progress.discard(key)

    async def _make_app(self) -> web.Application:
        """Make the web application: page, WebSocket and resources below the path /TOKEN, downloads below /download."""
        app = web.Application(middlewares=[self._require_token])
        app.on_response_prepare.append(self._add_security_headers)
        app.router.add_get("/download/{key}", self.handle_download, allow_head=False)
        app.add_subapp(f"/{self._token}", await super()._make_app())
        return app

    @web.middleware
    async def _require_token(
        self, request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        """Middleware that refuses every request without the token in the same way (HTTPNotFound), so that existing and
        unknown addresses cannot be distinguished. Exempt are downloads that are offered. The comparison takes constant
        time."""
        first_path_part = request.path.removeprefix("/").partition("/")[0]  # a path without a slash: OPTIONS *
        if first_path_part == "download" and await self._is_offered_download(request.path.rpartition("/")[2]):
            return await handler(request)
        if not hmac.compare_digest(first_path_part.encode("utf-8", "replace"), self._token.encode()):
            raise web.HTTPNotFound(text="The study is only at the whole address that hapteq serve printed.")
        if request.path == f"/{self._token}":
            raise web.HTTPFound(f"/{self._token}/")
        return await handler(request)

    async def _is_offered_download(self, key: str) -> bool:
        """Whether a download is offered under this key, which is random, known to this server's page only, and used
        once. It needs no token, because the page's script requests it at /download/KEY, outside the path of the
        token."""
        try:
            await self.download_manager.get_download_metadata(key)
        except KeyError:
            return False
        return True

    async def _add_security_headers(self, request: web.Request, response: web.StreamResponse) -> None:
        """Add the security headers to a response before it is sent."""
        response.headers.update(self._security_headers)

    def _make_security_headers(self) -> dict[str, str]:
        """Make the security headers of each response. The inline scripts of the page are allowed by their hashes;
        nothing is loaded from other servers, fonts included."""
        page_html = (self.templates_path / "app_index.html").read_text("utf-8")
        script_hashes = " ".join(f"'sha256-{_hash_script(script)}'" for script in _find_inline_scripts(page_html))
        allowed_origins = " ".join(
            sorted(origin for origin in self._allowed_origins if "[" not in origin)
        )  # a policy holds no IPv6
        policy_directives = (
            "default-src 'none'",
            f"script-src 'self' {allowed_origins} 'unsafe-hashes' {script_hashes}",
            # The terminal in the page sets styles while it draws.
            f"style-src 'self' {allowed_origins} 'unsafe-inline'",
            f"img-src 'self' {allowed_origins} data:",
            f"font-src 'self' {allowed_origins} data:",
            f"connect-src 'self' {allowed_origins} {allowed_origins.replace('http:', 'ws:')}",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
        return {
            "Content-Security-Policy": "; ".join(policy_directives),
            "X-Frame-Options": "DENY",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-store",
        }


async def _send_pings(websocket: web.WebSocketResponse) -> None:
    """Request a sign of life from the browser every `PING_S` (s), until the connection is closed."""
    with contextlib.suppress(ConnectionError):
        while True:
            await asyncio.sleep(PING_S)
            await websocket.ping()


def list_origins(host: str, port: int) -> frozenset[str]:
    """List the origins (scheme, host, port) of the server's page, as a browser states them in the Origin header."""
    host_names = LOCAL_HOST_NAMES if _format_url_host(host) in LOCAL_HOST_NAMES else (_format_url_host(host),)
    return frozenset(_format_origin(name, port) for name in host_names)


def _format_url_host(host: str) -> str:
    """Format the host as a URL contains it: an IPv6 address in brackets."""
    return f"[{host}]" if ":" in host else host


def _format_origin(host_name: str, port: int) -> str:
    """Format the origin, without the port where it is the default of http (80), as browsers do."""
    return f"http://{host_name}" if port == 80 else f"http://{host_name}:{port}"


def _find_inline_scripts(page_html: str) -> Iterator[str]:
    """Find the inline scripts and event handlers (on... attributes) of an HTML page."""
    yield from re.findall(r"<script>(.*?)</script>", page_html, re.DOTALL)
    yield from dict.fromkeys(re.findall(r'\bon[a-z]+="([^"]*)"', page_html, re.IGNORECASE))


def _hash_script(script: str) -> str:
    """Compute the SHA-256 of a script, base64, as a content security policy states it."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
