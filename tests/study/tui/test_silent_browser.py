"""A browser that falls silent while the application writes: the application ends, and only then may another begin."""

import asyncio
import contextlib
import socket
import sys
import time

import pytest

pytest.importorskip("textual_serve")

from aiohttp import ClientSession, WSServerHandshakeError, web

from study.tui import web_server

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

APP = """
import os, pathlib, select, sys, time

def write(payload):
    packet = b"D" + len(payload).to_bytes(4, "big") + payload
    while packet:
        packet = packet[os.write(1, packet):]

os.write(1, b"__GANGLION__\\n")
while not select.select([0], [], [], 0.02)[0] or b'"quit"' not in os.read(0, 65536):
    write(os.urandom(int(sys.argv[1])))
write(b"the last words")
time.sleep(0.5)  # as a force is released
pathlib.Path(sys.argv[2]).touch()
"""


async def wait_for_another_window(command, port):
    """Time (s) from the silence of a first window until a second one is let in."""
    server = web_server.ScreenServer(command, "localhost", port, print_line=lambda _: None)
    runner = web.AppRunner(await server._make_app())
    await runner.setup()
    await web.TCPSite(runner, "localhost", port).start()
    url, origin = f"http://localhost:{port}/{server._token}/ws", f"http://localhost:{port}"
    async with ClientSession() as session, session.ws_connect(url, origin=origin, autoping=False) as first:
        await first.receive(timeout=30)
        silent_since_s = time.monotonic()
        while time.monotonic() < silent_since_s + 20:
            with contextlib.suppress(WSServerHandshakeError):  # refused while the first counts as open
                async with session.ws_connect(url, origin=origin):
                    return time.monotonic() - silent_since_s
    pytest.fail("the first window counts as open for ever")


@pytest.mark.parametrize("packet_bytes", [100, 500_000], ids=["few words", "more than the connection holds"])
def test_another_window_waits_until_the_application_of_a_silent_browser_has_ended(tmp_path, monkeypatch, packet_bytes):
    monkeypatch.setattr(web_server, "HEARTBEAT_S", 1.0)
    monkeypatch.setattr(web_server, "RELOAD_TIMEOUT_S", 2.0)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ended = tmp_path / "ended"
    command = [sys.executable, "-c", APP, str(packet_bytes), str(ended)]
    assert asyncio.run(wait_for_another_window(command, port)) < 10
    assert ended.exists()
