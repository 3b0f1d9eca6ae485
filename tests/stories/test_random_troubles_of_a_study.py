"""Real SIGKILLs and SIGSTOPs of screen, engine, loop and sensors at random moments of whole sessions on the driver."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from troubled_study import Troubled

pytestmark = pytest.mark.real_time

TIMES = int(os.environ.get("TROUBLES", "200"))


@pytest.fixture
def troubled(stub, vendor, tmp_path, small_text, monkeypatch):
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "lab.toml"))
    vendor.accept("omega.3")
    stub.set("stiffness", 150)  # a hand that holds the handle
    stub.set("stretch_in_use", 10)  # the computer of the tests is busier than that of a lab
    text = small_text.replace("[25.0, 35.0]", "[35.0]").replace("after_run_s = 2.0", "after_run_s = 0.0")
    text = text.replace("reversals = 5", "reversals = 3").replace("averaged_reversals = 3", "averaged_reversals = 2")
    text = text.replace("reversals = 3 }]", "reversals = 1 }]") + "missed_ticks_limit = 1.0\n"
    protocol = tmp_path / "short.toml"
    protocol.write_text(text)

    def begin(seed: int) -> Troubled:
        begun.append(Troubled(stub, tmp_path, protocol, seed))
        return begun[-1]

    begun: list[Troubled] = []
    yield begin
    for each in begun:
        each.close()


@pytest.mark.parametrize("times", [3, pytest.param(TIMES, marks=pytest.mark.slow)])
@pytest.mark.timeout(3 * 3600)
def test_after_every_kill_and_stall_the_force_is_off_and_the_session_goes_on_with_all_answers(troubled, times):
    study = troubled(seed=18 + times)
    study.run(times)
    sys.stderr.write(f"{sum(study.made.values())} kills and stalls in {study.sittings} sittings: {study.made}\n")
    assert sum(study.made.values()) == times
    if times >= len(study.made):
        assert all(study.made.values())
