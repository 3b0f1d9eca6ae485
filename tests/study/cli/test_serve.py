"""The screen in a browser: what is refused beforehand, and a real page with a real program behind it."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("textual_serve")

from aiohttp import ClientSession, WSServerHandshakeError

from study.tui.web_server import origins

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

ROOT = Path(__file__).resolve().parents[3]
PATHS = os.pathsep.join((str(ROOT), str(ROOT / "study" / "launcher")))

APP = """
from textual.app import App
from textual.widgets import Label

class Small(App):
    def compose(self):
        yield Label("a small screen")

Small().run()
"""


def hapteq(*arguments: str, before: str = "", cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    script = f"import sys\n{before}\nfrom study.cli.main import main\nsys.exit(main(sys.argv[1:]))"
    return subprocess.run(
        [sys.executable, "-c", script, *arguments],
        capture_output=True, text=True, check=False, timeout=60, cwd=cwd, env={**os.environ, "PYTHONPATH": PATHS},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--plain",), "Leave --plain out, or run hapteq study --plain in a terminal."),
        (("--observer", "ideal"), "With --observer hapteq study opens none."),
        (("--host", "0.0.0.0"), "'0.0.0.0' means every address of this machine."),
        (("--bogus",), "No such option: --bogus"),
        (("--seed", "x"), "Invalid value for '--seed'"),
        (("--port", "0"), "Invalid value for '--port'"),
    ],
    ids=["plain", "observer", "host", "bogus", "seed", "port"],
)
def test_what_cannot_be_served_is_refused_before_a_browser_is_opened(arguments, expected):
    done = hapteq("serve", *arguments)
    assert done.returncode == 2
    assert expected in done.stderr
    assert "Traceback" not in done.stderr


def test_without_the_package_the_command_that_installs_it_is_said():
    done = hapteq("serve", before="sys.modules['textual_serve'] = None")
    assert done.returncode == 1
    assert "textual-serve is not installed." in done.stderr
    assert f"{sys.executable} -m pip install textual-serve" in done.stderr


@pytest.fixture
def port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def test_a_port_that_is_taken_is_told(port):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", port))
        taken.listen()
        done = hapteq("serve", "--port", str(port), "--host", "127.0.0.1")
    assert done.returncode == 1
    assert "The page cannot be served" in done.stderr
    assert "Choose another --port, or another --host." in done.stderr


def answers(port: int) -> bool:
    with socket.socket() as visitor:
        return visitor.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Address of a server in a process of its own, with a small program behind it."""
    program = tmp_path_factory.mktemp("served") / "small app.py"
    program.write_text(APP)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    script = (
        "import sys; from study.tui import web_server; web_server.RELOAD_S = 2.0; "
        f"web_server.ScreenServer([sys.executable, {str(program)!r}], 'localhost', {port}, "
        "say=lambda text: print(text, flush=True)).serve()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": PATHS}
    )
    assert process.stdout is not None
    said = process.stdout.readline()
    assert said == f"The study is at http://localhost:{port} for one window at a time. Ctrl-C ends it.\n"
    until_s = time.monotonic() + 20
    while not answers(port) and time.monotonic() < until_s:
        time.sleep(0.05)
    yield port
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    assert process.returncode == 0


def in_browser(port: int, visit):
    """visit(session, url): a coroutine in a browser without pictures."""

    async def go():
        async with ClientSession() as session:
            return await visit(session, f"http://127.0.0.1:{port}")

    return asyncio.run(go())


async def screen_text(session: ClientSession, url: str, origin: str | None) -> str:
    """What the program wrote, until its words are there."""
    text = ""
    async with session.ws_connect(f"{url}/ws", origin=origin) as wire:
        while "a small screen" not in text:
            message = await wire.receive(timeout=30)
            text += message.data.decode() if isinstance(message.data, bytes) else ""
    return text


def test_the_page_is_there(server):
    async def visit(session, url):
        async with session.get(url) as answer:
            return answer.status, await answer.text()

    status, page = in_browser(server, visit)
    assert status == 200
    assert f"ws://localhost:{server}/ws" in page


def test_the_program_draws_on_the_page_and_again_after_a_reload(server):
    async def visit(session, url):
        return [await screen_text(session, url, f"http://localhost:{server}") for _ in range(2)]

    assert all("a small screen" in text for text in in_browser(server, visit))


@pytest.mark.parametrize("origin", ["http://elsewhere.example", None])
def test_another_websites_page_may_not_drive_the_device(server, origin):
    async def visit(session, url):
        with pytest.raises(WSServerHandshakeError) as refused:
            await screen_text(session, url, origin)
        return refused.value.status

    assert in_browser(server, visit) == 403


def test_a_second_window_is_refused_while_the_first_is_open(server):
    async def visit(session, url):
        async with session.ws_connect(f"{url}/ws", origin=f"http://localhost:{server}") as first:
            await first.receive(timeout=30)
            with pytest.raises(WSServerHandshakeError) as refused:
                await screen_text(session, url, f"http://localhost:{server}")
        return refused.value.status

    assert in_browser(server, visit) == 409


def test_our_page_has_the_names_that_a_browser_gives_it():
    assert origins("localhost", 8000) == {f"http://{name}:8000" for name in ("localhost", "127.0.0.1", "[::1]")}
    assert origins("lab-pc", 80) == {"http://lab-pc"}
