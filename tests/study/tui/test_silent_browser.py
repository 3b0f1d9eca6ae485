"""A browser that falls silent while the application writes: the application ends, and only then may another begin. One
that answers late remains."""

import asyncio
import socket
import sys

import pytest

pytest.importorskip("textual_serve")

from aiohttp import ClientSession, WSMsgType, web

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


@pytest.fixture
def port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


async def visit_in_a_window(port, program, visit):
    """visit(server, window): a coroutine with a window, open and drawn, that answers no ping by itself."""
    server = web_server.ScreenServer([sys.executable, "-c", *program], "localhost", port, print_line=lambda _: None)
    runner = web.AppRunner(await server._make_app())
    await runner.setup()
    await web.TCPSite(runner, "localhost", port).start()
    url, origin = f"http://localhost:{port}/{server._token}/ws", f"http://localhost:{port}"
    async with ClientSession() as session, session.ws_connect(url, origin=origin, autoping=False) as window:
        await window.receive(timeout=30)
        await visit(server, window)
    await runner.cleanup()


@pytest.mark.parametrize("packet_bytes", [100, 500_000], ids=["few words", "more than the connection holds"])
def test_another_window_waits_until_the_application_of_a_silent_browser_has_ended(
    tmp_path, monkeypatch, port, packet_bytes
):
    async def wait_for_another_window(server, _):
        async with asyncio.timeout(20):
            await server._window_lock.acquire()

    monkeypatch.setattr(web_server, "SILENCE_S", 1.0)
    ended = tmp_path / "ended"
    asyncio.run(visit_in_a_window(port, (APP, str(packet_bytes), str(ended)), wait_for_another_window))
    assert ended.exists()


def test_a_browser_whose_answers_are_late_is_not_gone(tmp_path, monkeypatch, port):
    """As over a network that stalls: each answer comes after more than half of the accepted silence."""

    async def answer_late(_, window):
        answers = 0
        while answers < 4:
            message = await window.receive(timeout=30)
            assert message.type in (WSMsgType.PING, WSMsgType.BINARY)
            if message.type is WSMsgType.PING:
                await asyncio.sleep(0.6 * web_server.SILENCE_S)
                await window.pong(message.data)
                answers += 1

    monkeypatch.setattr(web_server, "SILENCE_S", 1.5)
    monkeypatch.setattr(web_server, "PING_S", 0.3)
    asyncio.run(visit_in_a_window(port, (APP, "10", str(tmp_path / "ended")), answer_late))
