"""A tone of known phase, by the host's clock, through pseudo-terminal, parser, clock fit and resampling onto ticks."""

import contextlib
import time

import numpy as np
import pytest

from equalizer.signals.lockin import estimate_phasors
from study.devices.accelerometer.history import SampleHistory
from study.devices.accelerometer.sensor import Accelerometer
from study.devices.accelerometer.serial_reader import open_serial
from study.devices.rig import AsynchronousAccelerometer
from tests.slow_instances import slow_rows
from tests.study.devices.accelerometer.pty_board import AT_REST, IDEAL, RAW_RANGE, Board, table_of, within

# The board is a thread of this process behind a pseudo-terminal: with all cores full it may send late.
pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

TONE_HZ, AMPLITUDE = 45.0, 8.0
ERROR_S = 1e-4
"""1.6 degrees at 45 Hz: of the clock's fit and of the resampling, besides the least delay of an arrival."""
ARRIVED_S = 0.3
"""The last tick lies so far back that its packets have arrived on a busy computer too."""


def tone(host_s: np.ndarray) -> np.ndarray:
    return AT_REST + AMPLITUDE * np.outer(np.sin(2 * np.pi * TONE_HZ * host_s), [1.0, -0.5, 0.0])


def late_s(acceleration: np.ndarray, tick_s: np.ndarray) -> float:
    """Of the tone along x, beside what it was."""
    found = estimate_phasors(acceleration[:, :1], 1000.0, TONE_HZ)[0][0]
    true = estimate_phasors(np.sin(2 * np.pi * TONE_HZ * tick_s)[:, None], 1000.0, TONE_HZ)[0][0]
    return -float(np.angle(found / true)) / (2 * np.pi * TONE_HZ)


@pytest.fixture
def arrivals(monkeypatch) -> list[tuple[float, float]]:
    """Of each arrival its newest sample's time by the board's clock (s) and its own by the host's (s)."""
    noted: list[tuple[float, float]] = []
    add = SampleHistory.add

    def noting(history, samples, arrived_s, counts):
        noted.append((1e-6 * samples.time_us[-1], arrived_s))
        add(history, samples, arrived_s, counts)

    monkeypatch.setattr(SampleHistory, "add", noting)
    return noted


def latest_s(board: Board, arrivals: list[tuple[float, float]], tick_s: np.ndarray) -> float:
    """How late the samples at the ticks may be placed: the fitted line lies below all arrivals, so that at the middle
    of the ticks it is no later than the least delay in one of their halves, which nothing tells the driver."""
    device_s, arrived_s = np.array(arrivals).T
    taken_s = board.taken_s(device_s)
    middle_s = (tick_s[0] + tick_s[-1]) / 2
    halves = [(tick_s[0] <= taken_s) & (taken_s < middle_s), (middle_s <= taken_s) & (taken_s < tick_s[-1])]
    return max(float((arrived_s - taken_s)[half].min()) for half in halves) + ERROR_S


@contextlib.contextmanager
def opened(board: Board):
    with contextlib.closing(Accelerometer(open_serial(board.path, 2_000_000), IDEAL, RAW_RANGE)) as sensor:
        assert within(5.0, lambda: sensor.counts.packets > 0)  # on a busy computer the first packets come late
        sensor.zero(0.2)
        yield sensor


def newest_of(sensor: Accelerometer) -> np.ndarray:
    time.sleep(0.01)
    return sensor.read_latest()[0]


@pytest.mark.parametrize(("rate_hz", "drift_ppm"), [*slow_rows((2000.0, 150.0), (4000.0, -150.0)), (10_000.0, 40.0)])
def test_a_tone_comes_out_with_its_phase_on_the_ticks(rate_hz, drift_ppm, arrivals):
    # The 32 bits of its clock begin anew on the way.
    with contextlib.closing(Board(rate_hz, drift_ppm, first_us=2**32 - 2_500_000)) as board, opened(board) as sensor:
        board.signal = tone
        time.sleep(2.5)
        tick_s = time.monotonic() - ARRIVED_S - 1.5 + np.arange(1500) / 1000
        sensed = sensor.sensed(tick_s[0], tick_s, 1000.0)
        # Late on a busy computer: its thread and the board's share this process.
        newest = next((found for _ in range(200) if np.isfinite(found := newest_of(sensor)).all()), newest_of(sensor))
    assert isinstance(sensor, AsynchronousAccelerometer) and np.isfinite(newest).all()
    health = sensed.health
    assert (health.ticks, health.unplaced_ticks, health.lost, health.restarts) == (1500, 0, 0, 0)
    assert health.packets == pytest.approx(1.5 * rate_hz, rel=0.4)
    assert -ERROR_S < late_s(sensed.acceleration_mps2, tick_s) < latest_s(board, arrivals, tick_s)
    amplitude = np.abs(estimate_phasors(sensed.acceleration_mps2, 1000.0, TONE_HZ)[0])
    np.testing.assert_allclose(amplitude, [AMPLITUDE, AMPLITUDE / 2, 0.0], atol=0.03)


def test_lost_torn_and_garbled_packets_are_counted_and_leave_the_phase_as_it_is(arrivals):
    random = np.random.default_rng(5)

    def spoiling(block: bytes) -> bytes:
        at, kind = int(random.integers(0, len(block))), random.integers(0, 12)
        if kind == 0:  # bytes lost
            return block[:at] + block[at + 7 :]
        if kind == 1:  # a bit flipped
            return block[:at] + bytes([block[at] ^ 4]) + block[at + 1 :]
        return block

    with contextlib.closing(Board(4000.0, 80.0)) as board, opened(board) as sensor:
        board.signal, board.spoil = tone, spoiling
        time.sleep(2.0)
        tick_s = time.monotonic() - ARRIVED_S - 1.5 + np.arange(1500) / 1000
        sensed = sensor.sensed(tick_s[0], tick_s, 1000.0)
    assert 0 < sensed.health.lost < 0.15 * sensed.health.packets
    assert sensed.health.spoiled_bytes > 8 * sensed.health.lost
    assert sensed.health.missing == pytest.approx(
        max(
            sensed.health.lost / (sensed.health.lost + sensed.health.packets),
            sensed.health.unplaced_ticks / sensed.health.ticks,
        )
    )
    assert -ERROR_S < late_s(sensed.acceleration_mps2, tick_s) < latest_s(board, arrivals, tick_s)


@pytest.mark.slow
def test_a_board_that_is_reset_goes_on_by_its_new_clock():
    with contextlib.closing(Board(2000.0, 100.0)) as board, opened(board) as sensor:
        board.signal = tone
        time.sleep(1.2)
        reset_s = time.monotonic()
        board.reset(silent_s=0.2)
        assert within(3.0, lambda: sensor.counts.restarts == 1)
        packets = sensor.counts.packets
        # A new clock is fitted to a second of arrivals, which take longer on a busy computer.
        assert within(6.0, lambda: sensor.counts.packets >= packets + 1.6 * 2000.0)
        tick_s = reset_s - 0.5 + np.arange(2000) / 1000
        sensed = sensor.sensed(tick_s[0], tick_s, 1000.0)
    assert sensed.health.restarts == 1
    unplaced = np.isnan(sensed.acceleration_mps2[:, 0])
    assert 100 < unplaced.sum() == sensed.health.unplaced_ticks < 1000
    # After it the new clock, by itself: 8 degrees late at most.
    after = tick_s > tick_s[unplaced][-1]
    assert -ERROR_S < late_s(sensed.acceleration_mps2[after], tick_s[after]) < 5 * ERROR_S


def test_a_board_that_falls_silent_leaves_the_ticks_without_a_value():
    with contextlib.closing(Board(2000.0)) as board, opened(board) as sensor:
        time.sleep(1.2)
        board.on = False
        time.sleep(0.3)
        tick_s = time.monotonic() - 0.2 + np.arange(200) / 1000
        sensed = sensor.sensed(tick_s[0], tick_s, 1000.0)
    assert np.isnan(sensed.acceleration_mps2).all()
    assert (sensed.health.unplaced_ticks, sensed.health.missing) == (200, 1.0)


def test_a_trial_on_the_driver_is_recorded_on_its_ticks_missed_ones_too(stub, rigs, tmp_path, monkeypatch, arrivals):
    from study.devices.clock import RealClock
    from study.devices.opening import open_device

    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    with contextlib.closing(Board(4000.0, 60.0)) as board:
        (tmp_path / "device.toml").write_text(table_of(board))
        with contextlib.closing(open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False)) as device:
            board.signal = tone
            device.hold(rigs.sine(0.5))
            until_s = time.monotonic() + 1.7
            while time.monotonic() < until_s:
                device.keep_alive()
                time.sleep(0.02)
            played = device.release()
            due_s = device._governor.compute_row_times()
    assert played.recording is not None and played.health.sensor is not None
    health = played.health.sensor
    assert (health.ticks, health.unplaced_ticks, health.lost) == (len(played.recording.response), 0, 0)
    response = played.recording.response.samples
    assert np.isfinite(response).all()
    tick_s = due_s[-len(response) :]
    assert -ERROR_S < late_s(response, tick_s) < latest_s(board, arrivals, tick_s)
    assert stub.safe
