"""The device behind its safety layer: the `Device` port over any rig, compiled or stepped, in any time.

What a force may be is decided in `study.devices.govern`, what is refused beforehand in `study.devices.admission`,
when ticks run in `virtual_drive` and `realtime_drive`.
"""

import atexit
from collections.abc import Callable

from equalizer.signals.signal import Signal
from study.devices.admission import check_commands, check_settings, check_stimulus
from study.devices.clock import Clock, VirtualClock
from study.devices.device import DeviceInfo, DeviceSettings, Fault, Played
from study.devices.governor import SETTLE_S, Governor
from study.devices.played import played_loop, played_once
from study.devices.realtime_drive import RealtimeDrive
from study.devices.rig import CompiledRig, Rig
from study.devices.runner import CompiledRunner, Runner, SteppedRunner
from study.devices.virtual_drive import VirtualDrive
from study.errors import DeviceError
from study.session.held_stimulus import HeldStimulus

BLOCK_S = 0.05
"""The longest stretch in real time during which Python is not asked."""

VIRTUAL_BLOCK_S = 5.0

PATIENCE_S = 1.0
"""Beyond all fades, before a device that does not become still counts as lost."""


class SafeDevice:
    """Raises `DeviceError` from the start for settings that are not safe, and later as the port says."""

    def __init__(self, rig: Rig | CompiledRig, settings: DeviceSettings, clock: Clock) -> None:
        check_settings(settings, rig.info)
        self._info = rig.info
        self._limits = settings.limits
        self._clock = clock
        self._governor = Governor(rig.info, settings)
        self._runner = self._runner_of(rig)
        self._drive = self._drive_of(clock)
        self._held: HeldStimulus | None = None
        self._closed = False
        atexit.register(self.close)

    @property
    def info(self) -> DeviceInfo:
        return self._info

    def hold(self, stimulus: HeldStimulus) -> None:
        self._must_be_idle()
        check_stimulus(stimulus, self._limits, self._info.sample_rate_hz)
        self._held = stimulus
        self._drive.start(lambda: self._governor.begin_hold(stimulus))

    def keep_alive(self) -> None:
        self._governor.sign_of_life()

    def fault(self) -> Fault:
        return Fault.STOPPED if self._governor.stop_asked else self._governor.fault

    def release(self) -> Played:
        stimulus = self._held
        if stimulus is None:
            raise _refused("Nothing is held, so nothing can be released.", "Call hold first.")
        self._governor.ask_release()
        self._wait_until_still(stimulus.fade_out_s)
        self._held = None
        return played_loop(self._governor, self._info)

    def play(self, commands: Signal, on_progress: Callable[[float], None] | None = None) -> Played:
        self._must_be_idle()
        check_commands(commands, self._limits, self._info.sample_rate_hz)
        self._drive.start(lambda: self._governor.begin_play(commands))
        try:
            self._attend_play(SETTLE_S + commands.duration_s, on_progress)
        except BaseException:
            self._let_go()
            raise
        self._wait_until_still(0.0)
        self._must_be_there()
        return played_once(self._governor, self._info)

    def stop(self) -> None:
        self._governor.ask_stop()

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        try:
            self._let_go()
        finally:
            self._drive.close()
            self._runner.disconnect()

    def _attend_play(self, duration_s: float, on_progress: Callable[[float], None] | None) -> None:
        nap_s = min(BLOCK_S, self._limits.watchdog_s / 4)
        started_s = self._clock.now_s()
        while self._governor.playing and (elapsed_s := self._clock.now_s() - started_s) < duration_s + PATIENCE_S:
            if on_progress is not None:
                on_progress(min(1.0, elapsed_s / duration_s))
            self._governor.sign_of_life()
            self._clock.sleep(nap_s)
        if on_progress is not None and not self._governor.playing:
            on_progress(1.0)

    def _let_go(self) -> None:
        self._governor.ask_let_go()
        self._wait_until_still(0.0)

    def _wait_until_still(self, fade_out_s: float) -> None:
        patience_s = fade_out_s + self._limits.release_s + self._limits.watchdog_s + PATIENCE_S
        until_s = self._clock.now_s() + patience_s
        nap_s = 5 / self._info.sample_rate_hz
        while self._governor.moving:
            if self._clock.now_s() > until_s:
                self._runner.give_up(TimeoutError(f"no answer within {patience_s:g} s"))
                return
            self._clock.sleep(nap_s)

    def _must_be_idle(self) -> None:
        if self._closed:
            raise _refused("The device is closed.", "Open it again.")
        if self._governor.stop_asked:
            raise _refused("The emergency stop was pressed.", "Make sure that all is well, then open the device again.")
        self._must_be_there()
        if self._held is not None or self._governor.moving:
            raise _refused("It is still playing.", "Call release first.")

    def _must_be_there(self) -> None:
        failure = self._runner.failure
        if failure is not None:
            raise DeviceError(
                "The device was lost",
                f"It stopped answering ({type(failure).__name__}: {failure}). Its force is off.",
                "Check its power and its cable, then open it again; a session goes on with `hapteq resume`.",
            ) from failure

    def _runner_of(self, rig: Rig | CompiledRig) -> Runner:
        virtual = self._clock.virtual
        if isinstance(rig, CompiledRig):
            block_ticks = round((VIRTUAL_BLOCK_S if virtual else BLOCK_S) * rig.info.sample_rate_hz)
            return CompiledRunner(rig, self._governor, block_ticks)
        return SteppedRunner(rig, self._governor, catches_up=virtual)

    def _drive_of(self, clock: Clock) -> VirtualDrive | RealtimeDrive:
        rate_hz = self._info.sample_rate_hz
        if isinstance(clock, VirtualClock):
            return VirtualDrive(self._runner, self._governor, clock, rate_hz)
        return RealtimeDrive(self._runner, self._governor, clock, rate_hz, self._limits.watchdog_s)


def _refused(happened: str, do_now: str) -> DeviceError:
    return DeviceError("The device cannot do this now", happened, do_now)
