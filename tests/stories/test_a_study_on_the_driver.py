"""A whole short study through the driver of a real device, on the stub of its library, in real time."""

import pytest

from study.cli.main import main
from study.devices.force_dimension import watchdog_proof

pytestmark = pytest.mark.real_time

RESUMED = 20
"""How often a busy computer may break the session off."""


@pytest.fixture
def short_file(tmp_path, small_text):
    text = small_text.replace("[25.0, 35.0]", "[35.0]").replace("after_run_s = 2.0", "after_run_s = 0.0")
    text = text.replace("reversals = 5", "reversals = 3").replace("averaged_reversals = 3", "averaged_reversals = 2")
    text = text.replace("reversals = 3 }]", "reversals = 1 }]")
    text += "missed_ticks_limit = 1.0\n"  # the computer of the tests may be busy
    path = tmp_path / "short.toml"
    path.write_text(text)
    return path


def test_a_simulated_participant_takes_a_study_on_the_driver(stub, short_file, tmp_path, capsys, monkeypatch):
    stub.set("stiffness", 150)  # a hand that holds the handle
    stub.set("watchdog_stretch", 20)  # the computer of the tests is busier than that of a lab
    monkeypatch.setattr(watchdog_proof, "MARGIN_S", 1.0)
    data = ("--data", str(tmp_path / "data"), "--device", "omega3", "--json")
    code = main(["study", "--protocol", str(short_file), "--observer", "ideal", "--seed", "5", *data])
    resumed = 0
    while code != 0 and resumed < RESUMED:  # a loop that stood still for 100 ms is a lost device: nothing is lost by it
        assert code in (3, 130), capsys.readouterr().err
        assert stub.safe
        resumed += 1
        code = main(["resume", "ideal1_001", *data])
    out, err = capsys.readouterr()
    assert code == 0, err
    assert "thresholds" in out
    assert stub.safe
    assert 0.3 < stub.get("peak_n") <= 4.5
    trials = (tmp_path / "data" / "ideal1_001" / "trials.csv").read_text().splitlines()
    assert len(trials) > 8
