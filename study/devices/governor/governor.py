"""Python interface of the safety layer's tick: owns its arrays, starts stimuli, sends requests, reads the counters.

The cells of the arrays are defined in `cells`; `govern.tick` computes with them.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from protocols.definition.plausibility import PlausibilitySettings
from study.devices.device import DeviceInfo, DeviceSettings, Fault, Health
from study.devices.governor import cells, govern
from study.devices.governor.plausibility import MOTION_CORNER_HZ
from study.devices.rig import READING_SIZE
from study.session.stimulus.held_stimulus import HeldStimulus

VELOCITY_CUTOFF_HZ = 50.0
"""Cutoff frequency (Hz) of the low-pass for the velocity of the damper, which reduces the encoders' quantization noise.
Chosen."""

ACCELERATION_TIME_CONSTANT_S = 0.02
"""Time constant (s) of the low-pass for the acceleration of the position readings, a plausibility check. Chosen: 20
ticks at 1 kHz."""

SETTLE_S = 0.5
"""Time (s) before the first command of `begin_play`: half for the fade-in of the spring, half for the handle to come to
rest. Chosen."""

FAULTS = tuple(Fault)
"""Faults in the order of their codes in `cells`."""


class Governor:
    """Settings, state, stimulus and recording ring of one device: the arrays of `govern.tick` and their access.

    settings, state: cells by the indices of `cells`; loop: the stimulus (n, 3), N; buffer: the recording ring (rows,
    ROW_SIZE); ring: the telemetry ring (rows, RING_WIDTH); force: the command of the last tick (3,), N.

    Requests (`request_*`, `restart_watchdog`) and queries may be made from any thread at any time, `begin_*`,
    `copy_rows` and `compute_row_times` only while nothing moves.
    """

    def __init__(self, info: DeviceInfo, settings: DeviceSettings, ring: FloatArray | None = None) -> None:
        """ring: the telemetry ring (`study.devices.telemetry`); None: no telemetry."""
        self._rate_hz = info.sample_rate_hz
        self._longest_hold_s = settings.limits.longest_hold_s
        self._keep_s = settings.keep_s
        self.settings = pack_settings(info, settings)
        self.state = np.zeros(cells.STATE_SIZE)
        self.loop: FloatArray = np.zeros((1, 3))
        self.buffer: FloatArray = np.zeros((1, cells.ROW_SIZE))
        self.ring: FloatArray = np.zeros((1, cells.RING_WIDTH)) if ring is None else ring
        self.force = np.zeros(3)
        self.missed_reading: FloatArray = np.full(READING_SIZE, np.nan)
        """Reading of a missed tick: all NaN."""

    @property
    def moving(self) -> bool:
        """Whether a stimulus or a fade is in progress."""
        return bool(self.state[cells.PHASE] != cells.IDLE)

    @property
    def playing(self) -> bool:
        """Whether a stimulus is in progress and not yet fading out."""
        return bool(self.state[cells.PHASE] == cells.PLAYING)

    @property
    def fault(self) -> Fault:
        """The fault of the present or last stimulus; `Fault.NONE` without one."""
        return FAULTS[int(self.state[cells.FAULT])]

    @property
    def ticks(self) -> int:
        """Ticks since `begin_hold` or `begin_play`, missed ticks included."""
        return int(self.state[cells.TICKS])

    @property
    def missed(self) -> int:
        """Ticks missed since `begin_hold` or `begin_play`."""
        return int(self.state[cells.MISSED])

    def begin_hold(self, stimulus: HeldStimulus) -> None:
        """Set up a stimulus whose loop is repeated until its release; the next tick is its first. Checks no limit."""
        fade_in, fade_out = self._count_ticks(stimulus.fade_in_s), self._count_ticks(stimulus.fade_out_s)
        self._reset_run(stimulus.onset_then_loop, self._count_recorded_rows(len(stimulus.loop)))
        state, onset_ticks = self.state, len(stimulus.onset) if stimulus.onset is not None else 0
        state[cells.ONSET_TICKS] = onset_ticks
        # An onset replaces the fade-in.
        state[cells.FADE_IN], state[cells.FADE_OUT] = 0 if onset_ticks else fade_in, fade_out
        state[cells.RAISED_COSINE] = stimulus.fade_shape == "raised_cosine"
        state[cells.SPRING_RAMP] = max(fade_in, self.settings[cells.LET_GO_TICKS])
        state[cells.LENGTH] = math.inf
        state[cells.LONGEST_HOLD] = self._count_ticks(self._longest_hold_s)
        state[cells.RECORD_FROM] = max(fade_in, onset_ticks)
        state[cells.PHASE] = cells.PLAYING

    def begin_play(self, commands: Signal) -> None:
        """Set up commands (n, 3), N, that are played once, after `SETTLE_S` with the spring alone; the next tick is the
        first of that time. Checks no limit."""
        settle_ticks = self._count_ticks(SETTLE_S)
        self._reset_run(commands.samples, len(commands))
        state = self.state
        state[cells.FIRST_TICK] = state[cells.TICK] = state[cells.LAST_KEEP_ALIVE_TICK] = -settle_ticks
        state[cells.FADE_OUT] = self.settings[cells.LET_GO_TICKS]
        state[cells.RAISED_COSINE] = 1.0
        state[cells.SPRING_RAMP] = settle_ticks // 2
        state[cells.LENGTH] = len(commands)
        state[cells.LONGEST_HOLD] = math.inf
        state[cells.PHASE] = cells.PLAYING

    def set_begin_time(self, now_s: float) -> None:
        """Store the time of the begin (s, by the loop's clock); the first tick is due one tick later."""
        self.state[cells.BEGIN_TIME_S] = now_s

    def restart_watchdog(self) -> None:
        """Restart the timeout of the safety layer's watchdog, at the next tick."""
        self.state[cells.KEEP_ALIVE] = 1.0

    def request_release(self) -> None:
        """Request the fade-out of the stimulus."""
        self.state[cells.RELEASE_REQUEST] = 1.0

    def request_let_go(self) -> None:
        """Request the safety layer's fade to zero within `release_s`, for any stimulus."""
        self.state[cells.LET_GO_REQUEST] = 1.0

    def request_stop(self) -> None:
        """Request the emergency stop: no force from the next tick on. It cannot be undone."""
        self.state[cells.STOP_REQUEST] = 1.0

    @property
    def stop_requested(self) -> bool:
        """Whether `request_stop` was called; it stays True."""
        return bool(self.state[cells.STOP_REQUEST] != 0.0)

    def abandon(self, fault: Fault) -> None:
        """End the stimulus at once, without waiting for the loop. The first fault is kept, except that FORCE_LEFT
        replaces any. The caller must ensure that the device gets zero force."""
        if fault is Fault.FORCE_LEFT or self.fault is Fault.NONE:
            self.state[cells.FAULT] = FAULTS.index(fault)
        self.state[cells.PHASE] = cells.IDLE
        self.state[cells.FORCE : cells.FORCE + 3] = 0.0

    def record_missed_ticks(self, ticks: int) -> None:
        """Record this number of missed ticks: the device held its last force, and its sensors were not read."""
        govern.record_missed_ticks(self.state, self.buffer, self.missed_reading, ticks)

    def count_lateness(self, is_late: bool, end_after_due_s: float) -> None:
        """Count the latest tick as late if it ended after the next was due (`is_late`), and keep the longest time from
        a tick's due time to its end (s)."""
        self.state[cells.LATE] += is_late
        self.state[cells.LATEST_S] = max(self.state[cells.LATEST_S], end_after_due_s)

    def collect_health(self) -> Health:
        """Collect the counters since `begin_hold` or `begin_play`; without the facts about an accelerometer with its
        own clock."""
        state = self.state
        return Health(
            fault=self.fault,
            ticks=int(state[cells.TICKS]),
            missed_ticks=int(state[cells.MISSED]),
            stimulus_clipped=int(state[cells.STIMULUS_CLIPPED]),
            feedback_clipped=int(state[cells.FEEDBACK_CLIPPED]),
            total_clipped=int(state[cells.TOTAL_CLIPPED]),
            slew_limited=int(state[cells.SLEW_LIMITED]),
            sensor_clipped=int(state[cells.SENSOR_CLIPS]),
            peak_command_n=float(state[cells.PEAK_FORCE]),
            late_ticks=int(state[cells.LATE]),
            latest_s=float(state[cells.LATEST_S]),
        )

    def copy_rows(self) -> FloatArray:
        """Copy the recorded rows, oldest first, shape (n, cells.ROW_SIZE), n at most the length of the ring."""
        recorded_count, ring_rows = int(self.state[cells.RECORDED_ROWS]), len(self.buffer)
        row_count = min(recorded_count, ring_rows)
        return self.buffer[np.arange(recorded_count - row_count, recorded_count) % ring_rows]

    def compute_row_times(self) -> FloatArray:
        """Compute the times at which the ticks of `copy_rows` were due, (n,), s, by the clock of `set_begin_time`."""
        state, row_count = self.state, len(self.copy_rows())
        last_tick = state[cells.RECORD_FROM] + state[cells.RECORDED_ROWS] - 1.0
        ticks = last_tick - np.arange(row_count)[::-1]
        due_s: FloatArray = (
            state[cells.BEGIN_TIME_S] + (ticks - state[cells.FIRST_TICK] + 1.0) * self.settings[cells.TICK_S]
        )
        return due_s

    @property
    def began_s(self) -> float:
        """Time of the begin of the stimulus (s), by the clock of `set_begin_time`."""
        return float(self.state[cells.BEGIN_TIME_S])

    @property
    def steady(self) -> FloatArray:
        """The repeated part of a held stimulus, (n, 3), N, without its onset; after `begin_play` all commands."""
        return self.loop[int(self.state[cells.ONSET_TICKS]) :]

    def _reset_run(self, stimulus_n: FloatArray, row_count: int) -> None:
        """Reset the state for a stimulus (n, 3), N, and a recording ring of this many rows."""
        self.loop = np.array(stimulus_n, order="C")
        self.buffer = np.full((max(row_count, 1), cells.ROW_SIZE), np.nan)
        # Never clear the stop request, not even briefly: another thread may be setting it at this moment.
        self.state[cells.STOP_REQUEST + 1 :] = 0.0
        self.state[cells.LAST_POSITION : cells.LAST_POSITION + 3] = np.nan
        self.state[cells.LAST_STEP] = np.nan

    def _count_recorded_rows(self, loop_rows: int) -> int:
        """Number of rows that the ring keeps of a loop of loop_rows rows: as many whole loops as fit in `keep_s`, or
        `keep_s` of a longer loop."""
        max_rows = self._count_ticks(self._keep_s)
        return max_rows // loop_rows * loop_rows if loop_rows <= max_rows else max_rows

    def _count_ticks(self, seconds: float) -> int:
        """Number of ticks nearest to a time (s)."""
        return round(seconds * self._rate_hz)


NEVER_TICKS = 1e15
"""Number of ticks that is never reached (30 000 years at 1 kHz), for a limit that does not apply."""


def pack_settings(info: DeviceInfo, settings: DeviceSettings) -> FloatArray:
    """Compute the array `settings` of `govern.tick`, fixed from opening to closing: SI units, times in ticks (`cells`).
    Stiffness K = m (2 pi f)²; low-pass coefficients 1 - exp(-2 pi f_c / rate). The check for readings that do not
    change is off for a simulated device that no force moves (a replay)."""
    limits, rate_hz = settings.limits, info.sample_rate_hz
    packed = np.zeros(cells.SETTINGS_SIZE)
    packed[cells.TICK_S] = 1.0 / rate_hz
    packed[cells.STIFFNESS] = info.effective_mass_kg * (2 * math.pi * settings.spring_frequency_hz) ** 2
    packed[cells.DAMPING] = settings.spring_damping_n_s_per_m
    packed[cells.VELOCITY_SMOOTHING] = 1.0 - math.exp(-2 * math.pi * VELOCITY_CUTOFF_HZ / rate_hz)
    packed[cells.CENTRE_X : cells.CENTRE_Z + 1] = settings.place_m
    packed[cells.STIMULUS_CAP] = limits.stimulus_cap_n
    packed[cells.FEEDBACK_CAP] = min(limits.feedback_cap_n, limits.total_cap_n)
    packed[cells.TOTAL_CAP] = limits.total_cap_n
    packed[cells.SLEW_STEP] = limits.slew_n_per_s / rate_hz
    packed[cells.WATCHDOG_TICKS] = round(limits.watchdog_s * rate_hz)
    packed[cells.LET_GO_TICKS] = max(1, math.floor(limits.release_s * rate_hz))
    _pack_plausibility(packed, limits.plausibility, rate_hz)
    if info.simulated and not info.moved_by_force:
        packed[cells.STALE_TICKS] = NEVER_TICKS
    return packed


def _pack_plausibility(packed: FloatArray, bounds: PlausibilitySettings, rate_hz: float) -> None:
    """Write the bounds of plausible position readings (`protocols.definition.plausibility`) into the array `packed`,
    with times in ticks and the speed in m per tick, and the coefficients of the low-passes of these checks."""
    packed[cells.WORKSPACE_RADIUS] = bounds.workspace_m
    packed[cells.LONGEST_JUMP] = bounds.longest_jump_m
    packed[cells.FASTEST_STEP] = bounds.fastest_m_per_s / rate_hz
    packed[cells.MAX_ACCELERATION] = bounds.acceleration_mps2
    packed[cells.ACCELERATION_SMOOTHING] = 1.0 - math.exp(-1.0 / (ACCELERATION_TIME_CONSTANT_S * rate_hz))
    packed[cells.STIMULUS_SMOOTHING] = 1.0 - math.exp(-2 * math.pi * MOTION_CORNER_HZ / rate_hz)
    packed[cells.RESOLUTION] = bounds.resolution_m
    packed[cells.FRICTION] = bounds.friction_n
    packed[cells.STALE_TICKS] = math.ceil(bounds.stale_s * rate_hz)
    # Half of still_s until the feedback force begins to be reduced at an unchanged reading, half for the reduction.
    packed[cells.REDUCTION_TICKS] = max(1, math.floor(bounds.still_s * rate_hz / 2))
