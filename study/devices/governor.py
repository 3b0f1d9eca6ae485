"""The governed tick's arrays and what may be asked of them: the only hands that touch `study.devices.govern` cells."""

import math

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from study.devices import govern
from study.devices.device import DeviceInfo, DeviceSettings, Fault, Health
from study.devices.rig import READING_SIZE
from study.session.held_stimulus import HeldStimulus

VELOCITY_CORNER_HZ = 50.0
"""Of the low-pass behind the spring's damping: far above the spring, far below the encoders' chatter."""

SETTLE_S = 0.5
"""Before a recording's first sample: half for the spring to come in, half for the handle to come to rest."""

FAULTS = tuple(Fault)


class Governor:
    """Settings, state, stimulus and recording ring of one device.

    The asking methods may be called from any thread at any time. `begin_*` and `rows` only while nothing moves.
    """

    def __init__(self, info: DeviceInfo, settings: DeviceSettings) -> None:
        self._rate_hz = info.sample_rate_hz
        self._longest_s = settings.limits.longest_hold_s
        self._keep_s = settings.keep_s
        self.settings = packed_settings(info, settings)
        self.state = np.zeros(govern.STATE_SIZE)
        self.loop: FloatArray = np.zeros((1, 3))
        self.buffer: FloatArray = np.zeros((1, govern.ROW_SIZE))
        self.force = np.zeros(3)

    @property
    def moving(self) -> bool:
        return bool(self.state[govern.PHASE] != govern.STILL)

    @property
    def playing(self) -> bool:
        """Neither over nor being released."""
        return bool(self.state[govern.PHASE] == govern.PLAYING)

    @property
    def fault(self) -> Fault:
        return FAULTS[int(self.state[govern.FAULT])]

    @property
    def ticks(self) -> int:
        return int(self.state[govern.TICKS])

    @property
    def missed(self) -> int:
        return int(self.state[govern.MISSED])

    def begin_hold(self, stimulus: HeldStimulus) -> None:
        fade_in, fade_out = self._ticks(stimulus.fade_in_s), self._ticks(stimulus.fade_out_s)
        self._begin(stimulus.played_once_then_loop, self._kept_of_loop(len(stimulus.loop)))
        state, lead = self.state, len(stimulus.onset) if stimulus.onset is not None else 0
        state[govern.LEAD] = lead
        # An onset has its own way of rising.
        state[govern.FADE_IN], state[govern.FADE_OUT] = 0 if lead else fade_in, fade_out
        state[govern.RAISED_COSINE] = stimulus.fade_shape == "raised_cosine"
        state[govern.SPRING_RAMP] = max(fade_in, self.settings[govern.LET_GO_TICKS])
        state[govern.LENGTH] = math.inf
        state[govern.LONGEST] = self._ticks(self._longest_s)
        state[govern.RECORD_FROM] = max(fade_in, lead)
        state[govern.PHASE] = govern.PLAYING

    def begin_play(self, commands: Signal) -> None:
        settle = self._ticks(SETTLE_S)
        self._begin(commands.samples, len(commands))
        state = self.state
        state[govern.START] = state[govern.TICK] = state[govern.LAST_SIGN] = -settle
        state[govern.FADE_OUT] = self.settings[govern.LET_GO_TICKS]
        state[govern.RAISED_COSINE] = 1.0
        state[govern.SPRING_RAMP] = settle // 2
        state[govern.LENGTH] = len(commands)
        state[govern.LONGEST] = math.inf
        state[govern.PHASE] = govern.PLAYING

    def sign_of_life(self) -> None:
        self.state[govern.SIGN_OF_LIFE] = 1.0

    def ask_release(self) -> None:
        """Fade out as the stimulus says."""
        self.state[govern.RELEASE_ASKED] = 1.0

    def ask_let_go(self) -> None:
        """Fade out within `release_s`, whatever is played."""
        self.state[govern.LET_GO_ASKED] = 1.0

    def ask_stop(self) -> None:
        """No force from the next tick on, and never again."""
        self.state[govern.STOP_ASKED] = 1.0

    @property
    def stop_asked(self) -> bool:
        return bool(self.state[govern.STOP_ASKED] != 0.0)

    def abandon(self, fault: Fault) -> None:
        """No force from now on: the loop itself is in trouble. The first fault stays, unless a worse one comes."""
        if fault is Fault.FORCE_LEFT or self.fault is Fault.NONE:
            self.state[govern.FAULT] = FAULTS.index(fault)
        self.state[govern.PHASE] = govern.STILL
        self.state[govern.FORCE : govern.FORCE + 3] = 0.0

    def miss(self, ticks: int) -> None:
        """So many ticks went by unattended: the device held its last force, and nobody read its sensors."""
        nothing = np.full(READING_SIZE, np.nan)
        for _ in range(ticks):
            govern.record(self.state, self.buffer, nothing)
            self.state[[govern.TICK, govern.TICKS, govern.MISSED]] += 1.0

    def health(self) -> Health:
        state = self.state
        return Health(
            fault=self.fault,
            ticks=int(state[govern.TICKS]),
            missed_ticks=int(state[govern.MISSED]),
            stimulus_clipped=int(state[govern.STIMULUS_CLIPPED]),
            total_clipped=int(state[govern.TOTAL_CLIPPED]),
            slew_limited=int(state[govern.SLEW_LIMITED]),
            sensor_clipped=int(state[govern.SENSOR_CLIPS]),
            peak_command_n=float(state[govern.PEAK]),
        )

    def rows(self) -> FloatArray:
        """What was recorded, shape (n, govern.ROW_SIZE), n at most the length of the ring."""
        recorded, size = int(self.state[govern.RECORDED]), len(self.buffer)
        kept = min(recorded, size)
        return self.buffer[np.arange(recorded - kept, recorded) % size]

    @property
    def steady(self) -> FloatArray:
        """(n, 3): what is repeated, without what leads into it."""
        return self.loop[int(self.state[govern.LEAD]) :]

    def _begin(self, played: FloatArray, rows: int) -> None:
        self.loop = np.array(played, order="C")
        self.buffer = np.full((max(rows, 1), govern.ROW_SIZE), np.nan)
        # Never clear the stop, not even for a moment: another thread may be asking for it just now.
        self.state[govern.STOP_ASKED + 1 :] = 0.0
        self.state[govern.LAST_POSITION : govern.LAST_POSITION + 3] = np.nan

    def _kept_of_loop(self, length: int) -> int:
        keep = self._ticks(self._keep_s)
        return keep // length * length if length <= keep else keep

    def _ticks(self, seconds: float) -> int:
        return round(seconds * self._rate_hz)


def packed_settings(info: DeviceInfo, settings: DeviceSettings) -> FloatArray:
    """The cells of `study.devices.govern` that hold from opening to closing."""
    limits, rate_hz = settings.limits, info.sample_rate_hz
    packed = np.zeros(govern.SETTINGS_SIZE)
    packed[govern.TICK_S] = 1.0 / rate_hz
    packed[govern.STIFFNESS] = info.effective_mass_kg * (2 * math.pi * settings.spring_frequency_hz) ** 2
    packed[govern.DAMPING] = settings.spring_damping_n_s_per_m
    packed[govern.VELOCITY_SHARE] = 1.0 - math.exp(-2 * math.pi * VELOCITY_CORNER_HZ / rate_hz)
    packed[govern.CENTRE_X : govern.CENTRE_Z + 1] = settings.place_m
    packed[govern.STIMULUS_CAP] = limits.stimulus_cap_n
    packed[govern.TOTAL_CAP] = limits.total_cap_n
    packed[govern.SLEW_STEP] = limits.slew_n_per_s / rate_hz
    packed[govern.WATCHDOG_TICKS] = round(limits.watchdog_s * rate_hz)
    packed[govern.LET_GO_TICKS] = max(1, math.floor(limits.release_s * rate_hz))
    return packed
