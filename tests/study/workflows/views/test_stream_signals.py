"""Force, acceleration and motion of each tick beside the markers, from the ring of the session that runs now."""

import contextlib
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.opening import open_device
from study.devices.safe import SafeDevice
from study.devices.telemetry import Ring
from study.session.watching.live_state import LiveState
from study.store.sessions.live_file import write_live
from study.workflows.views.lsl_outlets import MarkerOutlet, make_source_id
from study.workflows.views.stream_session import measure_offset_s
from study.workflows.views.stream_signals import CALLS_PER_RING_CHECK, STREAMS, SignalStreams

UTC = "2026-01-01T00:00:00+00:00"
LIVE = LiveState(UTC, "trial", UTC, "", 0.5, True, 1.0, False, 0)
OFFSET_S = 1000.25


class Kept:
    """Outlets of all streams, and what came out of them."""

    def __init__(self) -> None:
        self.samples: dict[str, list] = {}
        self.at_s: dict[str, list] = {}
        self.rates_hz: set[float] = set()

    def open(self, stream, rate_hz: float):
        self.rates_hz.add(rate_hz)
        self.samples[stream.name], self.at_s[stream.name] = [], []

        class Outlet:
            def push(_, samples, at_s) -> None:  # noqa: N805
                self.samples[stream.name].extend(samples.tolist())
                self.at_s[stream.name].extend(at_s.tolist())

        return Outlet()


def look(streams: SignalStreams) -> int:
    return sum(streams.push(OFFSET_S) for _ in range(CALLS_PER_RING_CHECK + 1))


def played(rigs, clock, device) -> int:
    device.hold(rigs.sine(2.0))
    for _ in range(10):
        clock.sleep(0.05)
        device.keep_alive()
    return device.release().health.ticks


def test_all_ticks_of_all_sittings_are_sent_with_their_times(tmp_path, rigs):
    kept, clock, ticks = Kept(), VirtualClock(), 0
    streams = SignalStreams(tmp_path, kept.open)
    assert look(streams) == 0 and kept.samples == {}  # nothing runs yet
    for _ in range(2):  # the second is resumed, with a ring of its own
        with contextlib.closing(SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, clock, Ring())) as device:
            write_live(tmp_path, replace(LIVE, telemetry=device.telemetry))
            assert look(streams) == 0
            started_s = clock.now_s()
            count = played(rigs, clock, device)
            assert look(streams) == 0
            at_s = kept.at_s["hapteq force"][ticks:]
            assert np.allclose(np.array(at_s) - OFFSET_S - started_s, np.arange(1, count + 1) / 1000.0, atol=1e-9)
            ticks += count
        look(streams)
    assert streams.sent_ticks == ticks and kept.rates_hz == {1000.0}
    for stream in STREAMS:
        assert np.shape(kept.samples[stream.name]) == (ticks, len(stream.channels)) == (ticks, len(stream.units))
    force = np.array(kept.samples["hapteq force"])
    assert 1.9 < np.linalg.norm(force[:, :3], axis=1).max() <= 2.0


@pytest.mark.parametrize("path", ["", "/nowhere/at/all.ring"])
def test_without_a_ring_nothing_is_sent(tmp_path, path):
    kept = Kept()
    streams = SignalStreams(tmp_path, kept.open)
    write_live(tmp_path, replace(LIVE, telemetry=path))
    assert look(streams) == 0 and kept.samples == {}


def test_a_ring_that_could_not_be_opened_at_first_is_opened_later(tmp_path, rigs):
    kept, clock = Kept(), VirtualClock()
    streams = SignalStreams(tmp_path, kept.open)
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, clock, Ring())) as device:
        ring = Path(device.telemetry)
        ring.rename(ring.with_suffix(".moved"))
        write_live(tmp_path, replace(LIVE, telemetry=device.telemetry))
        assert look(streams) == 0 and kept.samples == {}
        ring.with_suffix(".moved").rename(ring)
        assert look(streams) == 0
        ticks = played(rigs, clock, device)
        assert look(streams) == 0 and streams.sent_ticks == ticks > 0


def test_ticks_that_came_too_late_are_counted(tmp_path, rigs):
    clock, kept = VirtualClock(), Kept()
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, clock, Ring(rows=100))) as device:
        streams = SignalStreams(tmp_path, kept.open)
        write_live(tmp_path, replace(LIVE, telemetry=device.telemetry))
        look(streams)
        ticks = played(rigs, clock, device)
        assert look(streams) == ticks - 100
    assert streams.sent_ticks == 100


@pytest.mark.real_time
def test_force_and_acceleration_arrive_at_another_end_while_the_trial_runs(tmp_path, rigs):
    """The simulated device in real time, real outlets and inlets over the loopback: all ticks come, in order."""
    try:
        import pylsl
    except (ImportError, RuntimeError) as problem:  # its wheel for some systems is without the library
        pytest.skip(f"no loopback of signals was tested: {problem}")
    log = tmp_path / "events.jsonl"
    log.write_text(f"{time.time_ns()}\n")
    outlet = MarkerOutlet(log)
    streams = SignalStreams(tmp_path, outlet.make_signal_outlet)
    with contextlib.closing(open_device("simulated", rigs.SETTINGS, RealClock(), 1)) as device:
        write_live(tmp_path, replace(LIVE, telemetry=device.telemetry))
        streams.push(OFFSET_S)
        inlets = {name: inlet_of(pylsl, log, name) for name in ("hapteq force", "hapteq acceleration")}
        over = threading.Event()
        sending = threading.Thread(target=send, args=(streams, outlet, over))
        sending.start()
        device.hold(rigs.sine(2.0))
        during = 0
        for _ in range(100):
            time.sleep(0.02)
            device.keep_alive()
            during += len(inlets["hapteq force"].pull_chunk(max_samples=1)[1])
        health = device.release().health
        over.set()
        sending.join(20)
    force, at_s = pulled(inlets["hapteq force"], streams.sent_ticks - during)
    acceleration, _ = pulled(inlets["hapteq acceleration"], streams.sent_ticks)
    assert during > 0
    assert streams.sent_ticks == health.ticks
    assert np.all(np.diff(at_s) > 0) and np.std(acceleration) > 0.1
    assert np.linalg.norm(force[:, 3:], axis=1).max() <= rigs.LIMITS.total_cap_n * (1 + 1e-9)
    assert inlets["hapteq force"].info().desc().child("channels").child("channel").child_value("unit") == "N"


def send(streams: SignalStreams, outlet: MarkerOutlet, over: threading.Event) -> None:
    while not over.wait(0.02):
        streams.push(measure_offset_s(outlet, time.monotonic))
    streams.push(measure_offset_s(outlet, time.monotonic))


def inlet_of(pylsl, log: Path, name: str):
    found = pylsl.resolve_byprop("source_id", f"{make_source_id(log)} {name}", timeout=20)
    inlet = pylsl.StreamInlet(found[0])
    inlet.open_stream(timeout=20)
    return inlet


def pulled(inlet, count: int) -> tuple[np.ndarray, np.ndarray]:
    samples, stamps = [], []
    while len(samples) < count:
        chunk, at_s = inlet.pull_chunk(timeout=20, max_samples=count - len(samples))
        assert at_s, f"{len(samples)} of {count} samples came"
        samples.extend(chunk)
        stamps.extend(at_s)
    return np.array(samples), np.array(stamps)
