"""`hapteq serve` in headless Chromium: a session by keys, with a reload, a lost connection, a second tab, the report.

Needs the system's package chromium; `make prove-browser` runs it.
"""

import asyncio
import json
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

from aiohttp import ClientSession

from study.store.sessions.archive import SessionFolder
from study.workflows.results.fold_session import fold_session

sys.path.insert(0, str(Path(__file__).parent))

from chromium import PROGRAM, Chromium, Tab

pytestmark = [
    pytest.mark.slow,
    pytest.mark.real_time,
    pytest.mark.skipif(PROGRAM is None, reason="needs Chromium: the system's package chromium"),
]
ROOT = Path(__file__).resolve().parents[2]
PATHS = os.pathsep.join((str(ROOT), str(ROOT / "study" / "launcher")))


@pytest.fixture
def address(small_file, small_text, tmp_path):
    small_file.write_text(small_text.replace("[25.0, 35.0]", "[25.0]"))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen(
        [sys.executable, "-m", "study", "serve", "--port", str(port), "--protocol", str(small_file), "--seed", "4",
         "--data", str(tmp_path / "data")],
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": PATHS},
    )  # fmt: skip
    assert process.stderr is not None
    told = re.search(r"http://localhost:\d+/[\w-]+/", process.stderr.readline())
    assert told is not None
    yield told[0]
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)


@pytest.fixture
def browser(tmp_path):
    started = Chromium(tmp_path / "profile")
    yield started
    started.close()


class AtThePage:
    """Presses Enter where something is to be read, and answers trials, 1 and 2 in turn."""

    def __init__(self, tab: Tab, session: Path) -> None:
        self.tab, self.session = tab, session
        self._log, self._answered = session / "events.jsonl", set[tuple[int, int, int]]()

    def events(self) -> list[dict]:
        whole = self._log.read_bytes().rpartition(b"\n")[0] if self._log.exists() else b""
        return [json.loads(line) for line in whole.splitlines()]

    def count(self, kind: str) -> int:
        return sum(event["event"] == kind for event in self.events())

    async def sit(self, until, timeout_s: float = 150.0) -> None:
        give_up_s = time.monotonic() + timeout_s
        while not until():
            assert time.monotonic() < give_up_s, self.tab.screen[-3000:]
            last = (self.events() or [{"event": ""}])[-1]
            trial = (last.get("run"), last.get("trial"), last.get("attempt"))
            if last["event"] != "trial_presented":
                await self.tab.press("Enter")
                await asyncio.sleep(0.25)
            elif trial not in self._answered:
                self._answered.add(trial)
                await asyncio.sleep(0.3)
                await self.tab.press("12"[len(self._answered) % 2])
            await asyncio.sleep(0.1)

    async def resume(self) -> None:
        """From the start screen, as after a reload."""
        await self.tab.wait_for("New session")
        await self.tab.wait_for("P07_001")
        await self.tab.click()
        await self.tab.press("F3")
        await asyncio.sleep(0.5)
        self.tab.received = ""
        await self.tab.press("Enter")
        await self.tab.wait_for("r Resume")
        await self.tab.press("r")
        await self.tab.wait_for("Device check")


async def take_the_study(browser: Chromium, address: str, data: Path) -> str:
    """Returns what the page of the report says."""
    async with ClientSession() as session:
        tab = await browser.open(session, address)
        seat = AtThePage(tab, data / "P07_001")
        await tab.wait_for("New session")
        await tab.wait_for("A small study for tests")
        await tab.click()
        for key in "P07":
            await tab.press(key)
        await tab.press("F5")
        await tab.wait_for("Device check")
        await seat.sit(until=lambda: seat.count("answer_given") >= 3)

        second = await browser.open(session, address)
        async with asyncio.timeout(30):
            while not second.refused:
                await asyncio.sleep(0.2)
        assert "409" in second.refused[0]  # the study is open in another window
        await second.ask("Page.close")

        before = seat.count("answer_given")
        tab.received = ""
        await tab.ask("Page.reload")
        await seat.resume()
        await seat.sit(until=lambda: seat.count("answer_given") >= before + 3)

        before = seat.count("answer_given")
        tab.received = ""
        await tab.ask("Page.navigate", url="about:blank")  # the connection is gone, as when a network fails
        await tab.ask("Page.navigate", url=address)
        await seat.resume()
        await seat.sit(until=lambda: seat.count("session_closed") == 1)
        assert seat.count("answer_given") > before
        return await open_report(browser, session, seat)


async def open_report(browser: Chromium, session: ClientSession, seat: AtThePage) -> str:
    tab = seat.tab
    async with asyncio.timeout(90):
        while not (seat.session / "analysis" / "report.html").exists():
            await tab.press("Enter")
            await asyncio.sleep(0.5)
        tab.received = ""
        while "Openreport" not in re.sub(r"\s", "", tab.screen):
            await tab.press("Enter")
            await asyncio.sleep(1.0)
        await tab.press("o")
        while not (found := [each for each in await browser.targets(session) if "/download/" in each["url"]]):
            await asyncio.sleep(0.3)
        page = await browser.tab(session, found[0])
        while "Nothing was felt" not in (text := await page.text()):
            await asyncio.sleep(0.3)
    drawn = await page.ask("Runtime.evaluate", expression="document.querySelectorAll('svg').length")
    assert drawn["result"]["value"] >= 1  # figures
    return text


@pytest.mark.timeout(500)
def test_a_whole_session_by_keys_in_a_browser(browser, address, tmp_path):
    said = asyncio.run(take_the_study(browser, address, tmp_path / "data"))
    assert "P07" in said
    state = fold_session(SessionFolder(tmp_path / "data" / "P07_001")).state
    assert state.closed
