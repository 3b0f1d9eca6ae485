"""The screen in a browser: what is refused beforehand, and a real page with a real program behind it."""

import asyncio
import base64
import contextlib
import hashlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("textual_serve")

from aiohttp import ClientSession, WSServerHandshakeError

from study.tui.web_server import SILENCE_S, list_origins

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
        (("--host", "192.168.1.20"), "--host 192.168.1.20 listens beyond this computer"),
        (("--host", "localhost.example"), "add --open-to-network if that is wanted"),
        (("--bogus",), "No such option: --bogus"),
        (("--seed", "x"), "Invalid value for '--seed'"),
        (("--port", "0"), "Invalid value for '--port'"),
    ],
    ids=["plain", "observer", "host", "network", "name", "bogus", "seed", "port"],
)
def test_what_cannot_be_served_is_refused_before_a_browser_is_opened(arguments, expected):
    done = hapteq("serve", *arguments)
    assert done.returncode == 2
    assert expected in done.stderr
    assert "Traceback" not in done.stderr


def test_without_the_package_the_command_that_installs_it_is_reported():
    done = hapteq("serve", before="sys.modules['textual_serve'] = None")
    assert done.returncode == 1
    assert "textual-serve is not installed." in done.stderr
    assert f"{sys.executable} -m pip install textual-serve" in done.stderr


def test_the_flag_for_other_machines_says_what_it_opens():
    said = " ".join(hapteq("serve", "-h").stdout.split())
    for opened in ("take the study", "drive the device", "participants' codes", "Nothing is encrypted"):
        assert opened in said


@pytest.fixture
def port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def test_a_port_that_is_taken_is_reported(port):
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
    """(port, token) of a server in a process of its own, with a small program behind it."""
    program = tmp_path_factory.mktemp("served") / "small app.py"
    program.write_text(APP)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    script = (
        "import sys; from study.tui import web_server; web_server.RELOAD_TIMEOUT_S = 2.0; "
        f"web_server.ScreenServer([sys.executable, {str(program)!r}], 'localhost', {port}, "
        "print_line=lambda text: print(text, flush=True)).serve()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": PATHS},
    )  # fmt: skip
    assert process.stdout is not None
    said = process.stdout.readline()
    address = rf"http://localhost:{port}/([\w-]{{43}})/"
    told = re.fullmatch(rf"The study is at {address} for one window at a time. Ctrl-C ends it.\n", said)
    assert told is not None, said
    until_s = time.monotonic() + 20
    while not answers(port) and time.monotonic() < until_s:
        time.sleep(0.05)
    yield port, told[1]
    process.send_signal(signal.SIGINT)
    _, logged = process.communicate(timeout=20)
    assert process.returncode == 0
    assert told[1] not in logged


def in_browser(server: tuple[int, str], visit):
    """visit(session, url): a coroutine in a browser without pictures. url: with the token, without a slash."""
    port, token = server

    async def go():
        async with ClientSession() as session:
            return await visit(session, f"http://127.0.0.1:{port}/{token}")

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
            page = await answer.text()
        loaded = re.findall(r'(?:href|src)="http://localhost:\d+(/[^"]+)"', page)
        found = []
        for path in loaded:
            async with session.get(url.rpartition("/")[0] + path) as file:
                found.append(file.status)
        return answer.status, page, found

    status, page, found = in_browser(server, visit)
    port, token = server
    assert status == 200
    assert f"ws://localhost:{port}/{token}/ws" in page
    assert found == [200, 200]


@pytest.mark.parametrize(
    "path", ["", "/", "/ws", "/static/js/textual.js", "/static/", "/download/x", "/{}x/", "/{}/ws"]
)
def test_without_the_token_nothing_is_served(server, path):
    port, token = server

    async def visit(session, url):
        wrong = url.removesuffix(f"/{token}") + path.format(token[:-1])
        async with session.get(wrong) as answer:
            said = await answer.text()
        with pytest.raises(WSServerHandshakeError) as refused:
            async with session.ws_connect(wrong, origin=f"http://localhost:{port}"):
                pass
        return answer.status, said, refused.value.status

    status, said, refused = in_browser(server, visit)
    assert (status, refused) == (404, 404)
    assert said == "The study is only at the whole address that hapteq serve printed."


def test_an_address_that_is_no_path_is_refused_like_any_other(server):
    with socket.create_connection(("127.0.0.1", server[0]), timeout=10) as visitor:
        visitor.sendall(b"OPTIONS * HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        answer = b"".join(iter(lambda: visitor.recv(4096), b""))
    assert answer.startswith(b"HTTP/1.1 404 ")
    assert answer.endswith(b"The study is only at the whole address that hapteq serve printed.")


@pytest.mark.parametrize("path", ["/", "/static/js/textual.js", "/nothing", None])
def test_no_other_page_may_frame_or_be_told_of_this_one(server, path):
    async def visit(session, url):
        async with session.get(url.rpartition("/")[0] if path is None else url + path) as answer:
            return answer.headers

    headers = in_browser(server, visit)
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    policy = dict(part.split(" ", 1) for part in headers["Content-Security-Policy"].split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == "'none'"
    assert "'unsafe-inline'" not in policy["script-src"]
    assert "'unsafe-eval'" not in policy["script-src"]


def test_the_policy_allows_what_the_page_does(server):
    """Each script in the page by its hash; the files and the connection that it names by their origin."""

    async def visit(session, url):
        async with session.get(url) as answer:
            return await answer.text(), answer.headers["Content-Security-Policy"]

    page, said = in_browser(server, visit)
    policy = {name: values.split() for name, values in (part.split(" ", 1) for part in said.split("; "))}
    scripts = [*re.findall(r"<script>(.*?)</script>", page, re.DOTALL), *re.findall(r'onClick="(.*?)"', page)]
    assert len(scripts) == 3
    for script in scripts:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy["script-src"]
    own = f"http://localhost:{server[0]}"
    assert f'<script src="{own}/' in page
    assert all(own in policy[name] for name in ("script-src", "style-src", "img-src"))
    assert f"ws://localhost:{server[0]}" in policy["connect-src"]


def test_the_program_draws_on_the_page_and_again_after_a_reload(server):
    async def visit(session, url):
        return [await screen_text(session, url, f"http://localhost:{server[0]}") for _ in range(2)]

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
        async with session.ws_connect(f"{url}/ws", origin=f"http://localhost:{server[0]}") as first:
            await first.receive(timeout=30)
            with pytest.raises(WSServerHandshakeError) as refused:
                await screen_text(session, url, f"http://localhost:{server[0]}")
        return refused.value.status

    assert in_browser(server, visit) == 409


def test_a_browser_that_falls_silent_counts_as_gone_within_seconds(server):
    """As on a machine that sleeps, or behind a pulled cable: its connection is not closed."""
    origin = f"http://localhost:{server[0]}"

    async def visit(session, url):
        async with session.ws_connect(f"{url}/ws", origin=origin, autoping=False) as first:
            await first.receive(timeout=30)
            silent_since_s, gone_after_s = time.monotonic(), None
            while gone_after_s is None and time.monotonic() < silent_since_s + 60:
                with contextlib.suppress(WSServerHandshakeError):  # refused while the first counts as open
                    async with session.ws_connect(f"{url}/ws", origin=origin):
                        gone_after_s = time.monotonic() - silent_since_s
        return gone_after_s

    assert in_browser(server, visit) < 2 * SILENCE_S


def test_our_page_has_the_names_that_a_browser_gives_it():
    assert list_origins("localhost", 8000) == {f"http://{name}:8000" for name in ("localhost", "127.0.0.1", "[::1]")}
    assert list_origins("lab-pc", 80) == {"http://lab-pc"}
