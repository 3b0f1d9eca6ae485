"""Real SIGKILLs at random moments."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.real_time

SCRIPT = Path(__file__).with_name("killed_sessions.py")


def run(folder: Path, sessions: int, seed: int, text: str) -> list[dict]:
    protocol = folder / "small.toml"
    protocol.write_text(text)
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(folder / "data"), str(sessions), str(seed), str(protocol)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(SCRIPT.parents[2])},
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return [json.loads(line) for line in done.stdout.splitlines()]


def check(results: list[dict], sessions: int) -> None:
    assert len(results) == sessions
    for fact in ("finished", "prefixes_hold", "answers_hold", "decisions_equal"):
        assert [r["session"] for r in results if not r[fact]] == [], fact


def test_a_few_killed_sessions_finish_with_the_same_thresholds(tmp_path, small_text):
    results = run(tmp_path, 5, seed=5, text=small_text)
    check(results, 5)
    assert sum(r["kills"] for r in results) >= 5


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_a_hundred_killed_sessions_finish_with_the_same_thresholds(tmp_path, small_text):
    results = run(tmp_path, 100, seed=2026, text=small_text)
    check(results, 100)
    sys.stderr.write(f"{sum(r['kills'] for r in results)} kills, {sum(r['torn'] for r in results)} torn lines\n")
