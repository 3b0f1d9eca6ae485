"""The telemetry ring: every tick in it, no torn row out of it, what was lost is counted, and nothing is left behind."""

import contextlib
import math
import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from study.devices import telemetry
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.governor import cells, govern
from study.devices.governor.telemetry_row import write_row
from study.devices.opening import open_device, open_telemetry
from study.devices.safe import SafeDevice
from study.devices.telemetry import Ring, TelemetryReader
from study.errors import StudyError


@pytest.fixture
def ring():
    made = Ring(rows=64)
    yield made
    made.remove()


class Writer:
    """Ticks whose every cell follows from their number."""

    def __init__(self, ring: Ring) -> None:
        self.rows = ring.map_rows(1000.0)
        self.state, self.settings = np.zeros(cells.STATE_SIZE), np.zeros(cells.SETTINGS_SIZE)
        self.reading = np.zeros(10)

    def write(self, ticks: int) -> None:
        for _ in range(ticks):
            self.state[cells.TICK] += 1
            tick = self.state[cells.TICK]
            self.state[[cells.READING_TIME_S, cells.FORCE, cells.MISSED]] = tick, 2 * tick, 3 * tick
            self.reading[:] = 4 * tick
            govern.publish(self.state, self.settings, self.rows, self.reading)


def agree(read) -> bool:
    """Whether all cells of each row are of the same tick."""
    first = read.time_s
    return all(
        np.array_equal(found, factor * first)
        for factor, found in ((2, read.applied_n[:, 0]), (3, read.missed), (4, read.acceleration_mps2[:, 2]))
    )


def test_every_row_is_read_once_in_order(ring):
    writer = Writer(ring)
    writer.write(5)  # before the reader came
    reader = TelemetryReader(Path(ring.path))
    seen = []
    for ticks in (0, 1, 63, 7, 0, 20):
        writer.write(ticks)
        read = reader.read()
        assert len(read) == ticks and agree(read)
        seen.extend(read.time_s)
    assert seen == list(range(6, 6 + 91)) and reader.lost == 0
    assert reader.rate_hz == 1000.0


def test_what_was_overwritten_is_counted_as_lost(ring):
    writer, reader = Writer(ring), TelemetryReader(Path(ring.path))
    writer.write(200)
    assert list(reader.read().time_s) == list(range(137, 201))
    assert reader.lost == 136
    writer.write(3)
    assert list(reader.read().time_s) == [201, 202, 203] and reader.lost == 136


@pytest.mark.parametrize("cell", [cells.RING_INDEX, cells.RING_POSITION, cells.RING_CHECK])
def test_a_row_that_is_still_being_written_waits_and_comes_whole(ring, cell):
    writer, reader = Writer(ring), TelemetryReader(Path(ring.path))
    writer.write(3)
    place = (3, cell)  # of the third row, below the header
    whole = writer.rows[place]
    writer.rows[place] = -5.0
    assert list(reader.read().time_s) == [1, 2]
    writer.rows[place] = whole
    assert list(reader.read().time_s) == [3] and reader.lost == 0


def test_a_row_with_two_cells_in_each_others_place_is_not_whole(ring):
    writer, reader = Writer(ring), TelemetryReader(Path(ring.path))
    writer.write(1)
    pair = [cells.RING_POSITION, cells.RING_APPLIED]
    writer.rows[1, pair] = writer.rows[1, pair[::-1]]
    assert len(reader.read()) == 0


def test_a_row_that_never_becomes_whole_is_lost_when_it_is_overwritten(ring):
    writer, reader = Writer(ring), TelemetryReader(Path(ring.path))
    writer.write(3)
    writer.rows[2, cells.RING_POSITION] = -5.0
    assert list(reader.read().time_s) == [1]
    writer.write(64)
    assert list(reader.read().time_s) == list(range(4, 68)) and reader.lost == 2


@njit(nogil=True)
def hammer(state, settings, ring, reading, ticks: int) -> float:
    idle = 0.0
    for _ in range(ticks):
        state[cells.TICK] += 1
        tick = state[cells.TICK]
        state[cells.READING_TIME_S], state[cells.FORCE], state[cells.MISSED] = tick, 2 * tick, 3 * tick
        reading[:] = 4 * tick
        write_row(state, settings, ring, reading)
        for i in range(200):  # a reader must get something in between
            idle += math.sqrt(i * tick)
    return idle


@pytest.mark.slow
def test_beside_a_writer_at_full_speed_each_row_is_whole_or_counted(ring):
    """Thousands of times as fast as a loop, into room for 64: many are lost, and none is a mixture of two."""
    writer, reader = Writer(ring), TelemetryReader(Path(ring.path))
    total, over = 300_000, threading.Event()
    hammer(writer.state, writer.settings, writer.rows, writer.reading, 0)  # compiled now

    def write() -> None:
        hammer(writer.state, writer.settings, writer.rows, writer.reading, total)
        over.set()

    thread = threading.Thread(target=write)
    thread.start()
    got, last = 0, 0.0
    while True:
        was_over = over.is_set()
        read = reader.read()
        assert agree(read) and np.all(np.diff([last, *read.time_s]) > 0)
        got, last = got + len(read), read.time_s[-1] if len(read) else last
        if was_over:
            break
    thread.join()
    assert (got + reader.lost, last) == (total, total)
    assert got > 64


def test_a_device_writes_each_tick_of_a_stimulus(rigs):
    clock, ring = VirtualClock(), Ring()
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, clock, ring)) as device:
        reader_path = device.telemetry
        reader = open_telemetry(reader_path)
        started_s = clock.now_s()
        device.hold(rigs.sine(2.0))
        for _ in range(20):
            clock.sleep(0.05)
            device.keep_alive()
        health = device.health()
        held = reader.read()
        played = device.release()
        over = reader.read()
    assert len(held) == health.ticks and reader.lost == 0
    assert np.allclose(held.time_s - started_s, np.arange(1, health.ticks + 1) / 1000.0, atol=1e-9)
    assert list(held.tick) == list(range(health.ticks))
    assert np.linalg.norm(held.applied_n, axis=1).max() == pytest.approx(health.peak_command_n)
    assert set(held.phase) == {cells.PLAYING} and not np.any(held.fault)
    applied = np.concatenate([held.applied_n, over.applied_n]).tolist()
    recorded = played.recording.command.samples.tolist()
    assert any(applied[start : start + len(recorded)] == recorded for start in range(len(applied)))
    assert over.phase[-1] == cells.IDLE and not np.any(over.applied_n[-1])
    assert not Path(reader_path).is_file()


def test_a_fault_and_the_fade_after_it_are_in_the_ring(rigs):
    clock, rig, ring = VirtualClock(), rigs.ScriptedRig(), Ring()
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock, ring)) as device:
        reader = open_telemetry(device.telemetry)
        device.hold(rigs.sine(2.0))
        for _ in range(100):
            clock.sleep(0.1)  # no sign of life
        read = reader.read()
        device.release()
    stalled = list(Fault).index(Fault.STALLED)
    assert set(read.fault) == {0, stalled}
    faded = read.phase == cells.LETTING_GO
    assert np.count_nonzero(faded) and not np.any(read.commanded_n[faded])
    assert np.all(np.isnan(read.velocity_m_per_s[faded]))
    assert read.phase[-1] == cells.IDLE and not np.any(read.applied_n[-1])


def test_the_simulated_device_has_a_ring_in_real_time_and_none_in_virtual_time(rigs):
    with contextlib.closing(open_device("simulated", rigs.SETTINGS, RealClock(), 1)) as device:
        assert Path(device.telemetry).stat().st_mode & 0o077 == 0
    assert device.telemetry == ""
    with contextlib.closing(open_device("simulated", rigs.SETTINGS, VirtualClock(), 1)) as device:
        assert device.telemetry == ""


def test_without_room_for_a_ring_a_device_works_all_the_same(rigs, monkeypatch):
    def full(*args: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(telemetry.Path, "write_bytes", full)
    ring = Ring()
    assert ring.path == "" and ring.map_rows(1000.0) is None
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, clock, ring)) as device:
        device.hold(rigs.sine(2.0))
        clock.sleep(0.1)
        assert device.release().health.fault is Fault.NONE


@pytest.mark.parametrize("content", [b"", b"x" * 1000, bytes(8 * cells.RING_WIDTH * 3)])
def test_what_is_no_ring_is_reported(tmp_path, content):
    path = tmp_path / "a.ring"
    path.write_bytes(content)
    for each in (path, tmp_path / "none.ring"):
        with pytest.raises(StudyError, match="cannot be followed"):
            open_telemetry(str(each))


@pytest.mark.timeout(20)
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_a_pipe_in_the_place_of_a_ring_holds_up_nothing(tmp_path):
    os.mkfifo(tmp_path / "a.ring")
    with pytest.raises(StudyError, match="cannot be followed"):
        open_telemetry(str(tmp_path / "a.ring"))


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_the_ring_of_a_killed_program_is_removed_by_the_next_one(tmp_path, monkeypatch):
    monkeypatch.setattr(telemetry, "_choose_ring_folder", lambda: str(tmp_path))
    monkeypatch.setattr(telemetry, "MIN_ABANDONED_AGE_S", -1.0)
    alive = Ring(rows=2)
    program = (
        "import os, sys; from study.devices import telemetry; telemetry._choose_ring_folder = lambda: sys.argv[1];"
        "telemetry.Ring(rows=2); os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=False, timeout=60)
    assert len(list(tmp_path.glob("*.ring"))) == 2
    fresh = Ring(rows=2)
    assert {str(path) for path in tmp_path.glob("*.ring")} == {alive.path, fresh.path}
    for ring in (alive, fresh):
        ring.remove()
    assert not list(tmp_path.iterdir())
