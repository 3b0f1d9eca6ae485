"""Ctrl-C in the middle of a rehearsal, and the same command again."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from terminal import Terminal

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


@pytest.mark.slow
@pytest.mark.timeout(200)
def test_the_same_command_continues(small_file, tmp_path):
    command = (
        "rehearse",
        "--protocol",
        str(small_file),
        "--subjects",
        "5",
        "--workers",
        "1",
        "--out",
        str(tmp_path / "r"),
    )
    first = Terminal(*command)
    first.wait_for(r"[1-3]/5")
    first.type("\x03")
    assert first.end(timeout_s=60) == 130
    said = " ".join(first.screen.split())
    assert "Run the same command again: it continues where it stopped." in said
    assert "Traceback" not in said
    first.close()
    again = Terminal(*command)
    assert again.end(timeout_s=120) == 0
    assert "5/5" in again.screen
    assert re.search(r"25 Hz\s+[\d.]+ N\s+\d+\s+5", again.screen)
    again.close()
