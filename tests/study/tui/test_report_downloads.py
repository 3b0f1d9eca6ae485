"""A report that is opened on the screen in a browser: sent whole, once, to one window."""

import asyncio

import pytest
from aiohttp.test_utils import TestClient, TestServer

from study.tui.web_server import ScreenServer


class Program:
    """The program behind the page, as far as it sends a report: in one piece, when it is told to."""

    app_service_id = "1"

    def __init__(self, server: ScreenServer) -> None:
        self.downloads = server.download_manager
        self.asked, self.may_send = asyncio.Event(), asyncio.Event()
        self.left = [b"the report", b""]

    async def send_meta(self, wanted: dict) -> bool:
        self.asked.set()
        await self.may_send.wait()
        await self.downloads.chunk_received(wanted["key"], self.left.pop(0))
        return True


@pytest.fixture
def served():
    """served(visit) runs visit(client, program, token) beside a server that offers a report under the key `k`."""

    def run(visit):
        async def go():
            server = ScreenServer(["none"], "localhost", 8000, print_line=lambda text: None)
            program = Program(server)
            await server.download_manager.create_download(
                app_service=program, delivery_key="k", file_name="report.html", open_method="browser",
                mime_type="text/html",
            )  # fmt: skip
            async with TestClient(TestServer(await server._make_app())) as client:
                return await visit(client, program, f"/{server._token}")

        return asyncio.run(go())

    return run


@pytest.mark.parametrize("below_the_token", [True, False])
def test_a_report_that_is_being_taken_is_given_to_no_second_window(served, below_the_token):
    async def visit(client, program, token):
        path = f"{token if below_the_token else ''}/download/k"
        first = asyncio.create_task(client.get(path))
        await program.asked.wait()
        second = asyncio.create_task(client.get(path))
        done, _ = await asyncio.wait([second], timeout=5.0)
        program.may_send.set()
        return [answer.status for answer in (task.result() for task in done)], await (await first).text()

    assert served(visit) == ([409], "the report")


@pytest.mark.parametrize("below_the_token", [True, False])
def test_a_look_at_its_headers_does_not_use_it_up(served, below_the_token):
    async def visit(client, program, token):
        program.may_send.set()
        path = f"{token if below_the_token else ''}/download/k"
        looked = await client.head(path)
        return looked.status, await (await client.get(path)).text()

    status, text = served(visit)
    assert status in (405, 409) and text == "the report"
