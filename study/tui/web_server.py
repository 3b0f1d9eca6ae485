"""The screen in a browser, by textual-serve: for one window at a time, and for no page but our own.

A browser lets any page that it shows open a connection to this machine, so "only localhost" alone would let any
website drive the device. The connection's origin tells whose page it is.
"""

import asyncio
import logging
import shlex
from collections.abc import Callable, Sequence

from aiohttp import web
from rich.console import Console
from textual_serve.server import Server

RELOAD_S = 10.0
"""A page that is loaded again waits so long for the sitting of the old one to end."""

THIS_MACHINE = ("localhost", "127.0.0.1", "[::1]")


class ScreenServer(Server):
    """Starts `command` for whoever opens the page. A closed page ends it, as a closed terminal would."""

    def __init__(self, command: Sequence[str], host: str, port: int, say: Callable[[str], None]) -> None:
        super().__init__(shlex.join(command), host=host, port=port, title="hapteq study")
        self.console = Console(stderr=True)
        self._say = say
        self._origins = origins(host, port)
        self._seat = asyncio.Lock()

    def initialize_logging(self) -> None:
        """Each request in a line of its own would hide what must be read."""
        logging.basicConfig(level=logging.WARNING, format="%(message)s")

    async def on_startup(self, app: web.Application) -> None:
        self._say(f"The study is at {self.public_url} for one window at a time. Ctrl-C ends it.")

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        if request.headers.get("Origin") not in self._origins:
            raise web.HTTPForbidden(text="Only the page of this server may drive the device.")
        try:
            async with asyncio.timeout(RELOAD_S):
                await self._seat.acquire()
        except TimeoutError:
            raise web.HTTPConflict(text="The study is open in another window.") from None
        try:
            return await super().handle_websocket(request)
        finally:
            self._seat.release()


def origins(host: str, port: int) -> frozenset[str]:
    """What a browser calls our page."""
    names = THIS_MACHINE if host in THIS_MACHINE else (host,)
    return frozenset(f"http://{name}" if port == 80 else f"http://{name}:{port}" for name in names)
