"""Faults of the device in the middle of a study, by another stub: what the experimenter reads at the end."""

import threading

import pytest

from study.cli.main import main

pytestmark = pytest.mark.real_time

OF_THE_DRIVER = {
    "motors": ({"scaled_from_n": 0.1}, "Its motors cannot give the commanded force"),
    "silent cap": ({"silently_n": 0.1}, "It repeatedly reports another force than the one that it was sent"),
    "silent gain": ({"silent_gain": 0.65}, "It repeatedly reports another force than the one that it was sent"),
    "speed": ({"off_by": 2}, "moved faster than the device allows"),
    "power": ({"powered": 0}, "its power supply is off"),
    "reading": ({"read_fails": 2}, "dhdGetPosition: communication error"),
    "writing": ({"write_fails": 2}, "let go of the handle and switch the device off"),
    "jump": ({"jump_m": 0.06, "jump_every": 7}, "the position jumped further than a handle can move"),
    "no number": ({"no_number": 2}, "was no plausible number"),
    "frozen": ({"frozen": 1}, "the position stood still although the handle must have moved"),
}
EVERY_TIME = ("motors",)


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=() if each in EVERY_TIME else pytest.mark.slow) for each in OF_THE_DRIVER]
)
def test_a_fault_of_the_device_is_said_with_what_is_saved_and_what_to_do(stub, small_file, tmp_path, capsys, name):
    switches, words = OF_THE_DRIVER[name]
    stub.set("stiffness", 150)  # a hand that holds the handle
    stub.set("stretch_in_use", 20)  # the computer of the tests is busier than that of a lab
    over = threading.Event()

    def make_trouble() -> None:
        while not over.wait(0.005):
            if stub.peek("last_write") > 0.3 and stub.peek("force_on"):
                for switch, value in switches.items():
                    stub.set(switch, value)
                return

    trouble = threading.Thread(target=make_trouble)
    trouble.start()
    data = ("--data", str(tmp_path / "data"), "--device", "omega3", "--hands-off")
    code = main(["study", "--protocol", str(small_file), "--observer", "ideal", "--seed", "5", *data])
    over.set()
    trouble.join(20)
    said = capsys.readouterr().err
    assert code == 3, said
    assert "The session is not finished" in said
    assert words in said
    assert "answers are on disk" in said or "answer is on disk" in said
    assert "Run hapteq doctor --device omega3, which says what is wrong with it" in said
    (session,) = {log.parent for log in (tmp_path / "data").rglob("events.jsonl")}
    assert f"Continue with: hapteq resume {session} --device omega3" in said
    assert not stub.applied_n.any()
    assert stub.get("peak_n") <= 4.5
