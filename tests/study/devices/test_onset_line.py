"""Onset pulses: what goes out on a line, and when; a line that hangs or breaks costs a pulse and nothing else."""

import contextlib
import os
import threading
import time
import tty

import pytest
from pydantic import TypeAdapter, ValidationError

from study.devices import onset_line as module
from study.devices.onset_line import OnsetLine, PulseSettings, open_onset_line, open_port
from study.devices.opening import open_lab_onset_line
from study.errors import DeviceError

BYTE = PulseSettings("serial-byte", "/dev/ttyUSB0", code=7)


class Scripted:
    """A line that writes down what it was told. `broken` raises, `hangs` waits."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.broken: Exception | None = None
        self.hangs = threading.Event()
        self.hangs.set()

    def open(self, settings: PulseSettings):
        self.told.append("open")
        return self

    def raise_level(self) -> None:
        self.hangs.wait(5.0)
        if self.broken is not None:
            raise self.broken
        self.told.append("high")

    def lower_level(self) -> None:
        self.told.append("low")

    def close(self) -> None:
        self.told.append("close")


@pytest.fixture
def line():
    return Scripted()


@pytest.fixture
def pulses(line):
    with contextlib.closing(OnsetLine(BYTE, line.open)) as pulses:
        yield pulses


def test_a_pulse_goes_up_and_down_and_is_stamped_in_between(line, pulses, patient):
    before_s = time.monotonic()
    pulse = pulses.send_pulse()
    assert before_s <= pulse.at_s <= time.monotonic()
    assert (pulse.line, pulse.trouble) == ("byte 7 of /dev/ttyUSB0", "")
    pulses.close()
    assert line.told == ["open", "high", "low", "low", "close"]


def test_a_line_that_breaks_loses_its_pulse_and_is_opened_anew_for_the_next(line, pulses, patient):
    line.broken = OSError(5, "Input/output error")
    lost = pulses.send_pulse()
    assert lost.at_s is None and "Input/output error" in lost.trouble
    line.broken = None
    wait_until_free(pulses)
    assert pulses.send_pulse().at_s is not None
    assert line.told.count("open") == 2 and "close" in line.told


def test_a_line_that_hangs_holds_up_nothing_and_serves_again(line, pulses):
    line.hangs.clear()
    lost = [pulses.send_pulse() for _ in range(3)]
    assert all(pulse.at_s is None and pulse.trouble for pulse in lost)
    assert lost[1].trouble == "the previous pulse has not been finished"
    line.hangs.set()
    while (pulse := pulses.send_pulse()).at_s is None:
        time.sleep(0.01)
    assert pulse.trouble == ""


def test_the_line_that_was_opened_before_a_session_serves_its_first_pulse(line, monkeypatch, patient):
    monkeypatch.setattr(module, "open_port", line.open)
    with contextlib.closing(open_onset_line(BYTE)) as pulses:
        assert line.told == ["open"]
        assert pulses.send_pulse().at_s is not None
    assert line.told == ["open", "high", "low", "low", "close"]


def test_an_error_without_words_is_named_by_its_kind(line, pulses, patient):
    line.broken = ValueError()
    assert pulses.send_pulse().trouble == "ValueError"


@pytest.fixture
def patient(monkeypatch):
    """A busy computer may take longer than a line may."""
    monkeypatch.setattr(module, "PULSE_TIMEOUT_S", 20.0)


def wait_until_free(pulses: OnsetLine) -> None:
    while pulses._pulse_lock.locked():
        time.sleep(0.002)


@pytest.fixture
def terminal():
    master, slave = os.openpty()
    tty.setraw(slave)
    ends = [master, slave]
    yield ends, os.ttyname(slave)
    for end in ends:
        with contextlib.suppress(OSError):
            os.close(end)


@pytest.mark.real_time
def test_bytes_over_a_serial_line(terminal, patient):
    (master, _), path = terminal
    with contextlib.closing(open_onset_line(PulseSettings("serial-byte", path, code=7))) as pulses:
        for _ in range(3):
            assert pulses.send_pulse().at_s is not None
            wait_until_free(pulses)
    came = b""
    while len(came) < 7:
        came += os.read(master, 100)
    assert came == b"\x07\x00\x07\x00\x07\x00\x00"


@pytest.mark.real_time
def test_a_serial_line_that_is_unplugged_loses_pulses(terminal, patient):
    ends, path = terminal
    with contextlib.closing(open_onset_line(PulseSettings("serial-byte", path))) as pulses:
        assert pulses.send_pulse().at_s is not None
        while ends:
            os.close(ends.pop())
        wait_until_free(pulses)
        assert pulses.send_pulse().trouble


class Control:
    """pyserial's port, as far as control lines go."""

    def __init__(self, **named: object) -> None:
        self.seen: list[tuple[str, object]] = []

    def __setattr__(self, name: str, value: object) -> None:
        super().__setattr__(name, value)
        if name != "seen":
            self.seen.append((name, value))

    def open(self) -> None:
        self.seen.append(("open", None))

    def close(self) -> None:
        self.seen.append(("close", None))


@pytest.mark.parametrize("name", ["dtr", "rts"])
def test_control_lines_are_low_before_the_port_opens(monkeypatch, name):
    import serial

    made = []
    monkeypatch.setattr(serial, "Serial", lambda **named: made.append(Control(**named)) or made[0])
    line = open_port(PulseSettings(f"serial-{name}", "/dev/ttyUSB0"))
    for act in (line.raise_level, line.lower_level, line.close):
        act()
    low = made[0].seen.index((name, False))
    assert low < made[0].seen.index(("open", None))
    assert made[0].seen[-3:] == [(name, True), (name, False), ("close", None)]


def test_a_parallel_port_is_claimed_shows_the_code_and_is_given_back(monkeypatch, tmp_path, patient):
    fcntl = pytest.importorskip("fcntl", reason="parallel ports are Linux only")
    port, asked = tmp_path / "parport0", []
    port.write_bytes(b"")
    monkeypatch.setattr(fcntl, "ioctl", lambda file, request, value: asked.append((request, value)))
    with contextlib.closing(OnsetLine(PulseSettings("parallel", str(port), code=9), open_port)) as pulses:
        assert pulses.send_pulse().line == f"data lines 9 of {port}"
    high, low = (module.WRITE_DATA, b"\x09"), (module.WRITE_DATA, b"\x00")
    assert asked == [(module.CLAIM_PORT, 0), high, low, low, (module.RELEASE_PORT, 0)]


@pytest.mark.parametrize("kind", ["serial-byte", "serial-dtr", "parallel"])
def test_a_line_that_is_not_there_stops_before_the_session(tmp_path, kind, monkeypatch):
    file = tmp_path / "device.toml"
    file.write_text(f'[pulse]\nkind = "{kind}"\nport = "{tmp_path}/none"\n')
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(file))
    with pytest.raises(DeviceError, match="onset pulses cannot be opened"):
        open_lab_onset_line()
    file.write_text("")
    assert open_lab_onset_line() is None


@pytest.mark.parametrize("wrong", [{"code": 0}, {"code": 256}, {"width_s": 0.0}, {"kind": "usb"}, {"volts": 5}])
def test_settings_that_give_no_pulse_are_refused(wrong):
    with pytest.raises(ValidationError):
        TypeAdapter(PulseSettings).validate_python({"kind": "serial-byte", "port": "COM3"} | wrong)
