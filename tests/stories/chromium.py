"""Headless Chromium by its DevTools protocol: tabs, keys, what a page was sent and what it says."""

import asyncio
import base64
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType

NAMES = ("chromium", "chromium-browser", "google-chrome")
PROGRAM = next((found for name in NAMES if (found := shutil.which(name))), None)
ESCAPES = re.compile(r"\x1b(\[[0-9;?<>=]*[A-Za-z]|[=>])")
CODES = {"Enter": (13, "\r"), "Escape": (27, ""), "ArrowDown": (40, ""), "F3": (114, ""), "F5": (116, "")}
"""Windows' number of a key, and the text that it types."""


class Tab:
    """One page. Keys go to it as a keyboard sends them; what its websockets received is kept."""

    def __init__(self, wire: ClientWebSocketResponse) -> None:
        self._wire, self._asked, self._answers = wire, 0, dict[int, asyncio.Future[Any]]()
        self.received = ""
        self.refused: list[str] = []
        """What was said of websockets that the server did not open."""
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for message in self._wire:
            if message.type is not WSMsgType.TEXT:
                break
            said = json.loads(message.data)
            if "id" in said:
                self._answers.pop(said["id"]).set_result(said.get("result", said))
            elif said["method"] == "Network.webSocketFrameReceived":
                frame = said["params"]["response"]
                if frame["opcode"] == 2:
                    self.received += base64.b64decode(frame["payloadData"]).decode("utf-8", "replace")
            elif said["method"] == "Network.webSocketFrameError":
                self.refused.append(said["params"]["errorMessage"])

    async def ask(self, method: str, **parameters: Any) -> Any:
        self._asked += 1
        answer = self._answers[self._asked] = asyncio.get_running_loop().create_future()
        await self._wire.send_json({"id": self._asked, "method": method, "params": parameters})
        return await asyncio.wait_for(answer, 30)

    async def press(self, key: str) -> None:
        number, text = CODES.get(key, (ord(key.upper()[0]), key))
        of = {"key": key, "code": key, "windowsVirtualKeyCode": number, "nativeVirtualKeyCode": number}
        await self.ask("Input.dispatchKeyEvent", type="keyDown", text=text, **of)
        await self.ask("Input.dispatchKeyEvent", type="keyUp", **of)

    async def click(self) -> None:
        """At the first field of the page, which gets the keys from then on."""
        for kind in ("mousePressed", "mouseReleased"):
            await self.ask("Input.dispatchMouseEvent", type=kind, x=200, y=45, button="left", clickCount=1)

    @property
    def screen(self) -> str:
        """All that the terminal in the page was sent, without colours."""
        return ESCAPES.sub("", self.received)

    async def wait_for(self, words: str, timeout_s: float = 60.0) -> None:
        """In what was sent since `received` was emptied; spaces may be drawn as moves of the cursor."""
        squeezed = re.sub(r"\s", "", words)
        async with asyncio.timeout(timeout_s):
            while squeezed not in re.sub(r"\s", "", self.screen):
                await asyncio.sleep(0.1)

    async def text(self) -> str:
        found = await self.ask("Runtime.evaluate", expression="document.documentElement.textContent")
        return str(found["result"].get("value", ""))


class Chromium:
    def __init__(self, profile: Path) -> None:
        assert PROGRAM is not None
        self.process = subprocess.Popen(
            [PROGRAM, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0",
             "--window-size=1400,900", f"--user-data-dir={profile}", "about:blank"],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        assert self.process.stderr is not None
        said = ""
        while not (told := re.search(r"ws://(127\.0\.0\.1:\d+)/", said)):
            said = self.process.stderr.readline()
            assert said, "Chromium ended before it listened"
        self._at = f"http://{told[1]}"

    async def open(self, session: ClientSession, url: str) -> Tab:
        async with session.put(f"{self._at}/json/new?about:blank") as answer:
            target = await answer.json(content_type=None)
        tab = await self.tab(session, target)
        await tab.ask("Page.navigate", url=url)
        return tab

    async def tab(self, session: ClientSession, target: dict[str, Any]) -> Tab:
        tab = Tab(await session.ws_connect(target["webSocketDebuggerUrl"], max_msg_size=0))
        for domain in ("Page", "Network", "Runtime"):
            await tab.ask(f"{domain}.enable")
        await tab.ask("Emulation.setFocusEmulationEnabled", enabled=True)
        return tab

    async def targets(self, session: ClientSession) -> list[dict[str, Any]]:
        async with session.get(f"{self._at}/json/list") as answer:
            return list(await answer.json(content_type=None))

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(timeout=20)
        if self.process.stderr is not None:
            self.process.stderr.close()
