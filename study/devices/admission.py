"""Checks of the safety layer before anything moves: settings, hardware and stimuli that it refuses, with the reason.

This is the first of two barriers; the second is the control tick (`governor.govern`), which limits every force
independent of these checks. Reasons for the limits: docs/safety.md.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import DeviceInfo, DeviceSettings
from study.errors import DeviceError
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.limits import Limits

HAND_STIMULUS_CAP_N = 3.0
"""Upper limit of the stimulus's force cap with a hand on the handle (N); docs/safety.md."""
HAND_TOTAL_CAP_N = 6.0
"""Upper limit of the caps on the total and on the feedback force with a hand on the handle (N). Without a hand,
`DeviceSettings.beyond_hand_ceiling` allows caps up to the device's own maximum."""

TOLERANCE = 1 + 1e-9
"""Factor on caps and slew limit that allows for rounding, for a stimulus exactly at its cap."""

HIGHEST = {
    "slew_n_per_s": 1e5,
    "longest_hold_s": 600.0,
    "watchdog_s": 5.0,
    "release_s": 1.0,
    "keep_s": 600.0,
}
"""Upper bounds of settings (N/s, s). They also apply to settings that do not come from a validated protocol."""

HIGHEST_PLAUSIBLE = {
    "workspace_m": 0.5,
    "fastest_m_per_s": 20.0,
    "longest_jump_m": 0.5,
    "acceleration_mps2": 1e4,
    "resolution_m": 1e-3,
    "friction_n": 3.0,
    "stale_s": 5.0,
    "still_s": 60.0,
}
"""Upper bounds of the plausibility limits (m, m/s, m/s², N, s), as in `protocols.definition.plausibility`; repeated for
settings that do not come from a validated protocol."""

RATES_HZ = (100.0, 10_000.0)
"""Lowest and highest accepted rate of a device's control loop (Hz)."""

HEAVIEST_KG = 10.0
"""Largest accepted effective mass (kg), above that of any handle of a desktop device. The stiffness of the centring
spring is proportional to the mass that the device reports."""

LONGEST_DROP_S = 1.0
"""Longest accepted time (s) after the last command until the hardware itself drops the force."""

FADE_SHAPES = ("raised_cosine", "linear")
"""Shapes of a stimulus's fades that the control tick implements."""


def check_settings(settings: DeviceSettings, info: DeviceInfo) -> None:
    """Check settings and device before opening. Raises `DeviceError` for a limit outside its bounds or not finite, and
    for a device that reports an implausible rate or mass."""
    _check_info(info)
    limits = settings.limits
    times = {name: getattr(limits, name) for name in HIGHEST if name != "keep_s"} | {"keep_s": settings.keep_s}
    for name, value in times.items():
        _check_within(name, value, HIGHEST[name])
    _check_caps(settings, info)
    for name, highest in HIGHEST_PLAUSIBLE.items():
        _check_within(f"plausibility.{name}", getattr(limits.plausibility, name), highest, zero=name == "friction_n")
    _check_within("spring_frequency_hz", settings.spring_frequency_hz, 10.0, zero=True)
    _check_within("spring_damping_n_s_per_m", settings.spring_damping_n_s_per_m, 20.0, zero=True)
    if not all(math.isfinite(component) for component in settings.place_m):
        raise _settings_error(f"place_m is {settings.place_m}; it must be three numbers, in metres.")


def check_hardware(drops_force_after_s: float, info: DeviceInfo, settings: DeviceSettings) -> None:
    """Check that the hardware drops its force by itself, `drops_force_after_s` after the last command. Raises
    `DeviceError` for a real device in a hand that would keep its force after this program has ended."""
    if info.simulated or not settings.hand_on_handle or 0 < drops_force_after_s <= LONGEST_DROP_S:
        return
    raise DeviceError(
        "The device was not opened: it has no watchdog",
        f"If this program were killed, '{info.name}' would hold its last force (drops_force_after_s is "
        f"{drops_force_after_s:g}; it must be above 0 and at most {LONGEST_DROP_S:g}).",
        "Switch the watchdog in the device's firmware on, or use it without a hand on the handle.",
    )


def check_stimulus(stimulus: HeldStimulus, limits: Limits, rate_hz: float) -> None:
    """Check fades, format, force and slew rate of a repeated stimulus, also from the loop's last sample to its first
    and from zero through the onset. Raises `DeviceError` for a stimulus that is not within the limits."""
    if stimulus.fade_shape not in FADE_SHAPES:
        raise _refusal(f"its fade shape is {stimulus.fade_shape!r}; known are {' and '.join(FADE_SHAPES)}")
    for name, seconds in (("fade_in_s", stimulus.fade_in_s), ("fade_out_s", stimulus.fade_out_s)):
        if not 0 <= seconds <= 10:
            raise _refusal(f"its {name} is {seconds}; it must lie between 0 and 10 s")
    _check_forces(stimulus.loop, limits, rate_hz)
    samples = stimulus.loop.samples
    _check_steps(np.diff(samples, axis=0, append=samples[:1]), limits, rate_hz)
    if stimulus.onset is not None:
        _check_forces(stimulus.onset, limits, rate_hz)
        _check_steps(np.diff(stimulus.onset.samples, axis=0, prepend=0.0, append=samples[:1]), limits, rate_hz)


def check_commands(commands: Signal, limits: Limits, rate_hz: float) -> None:
    """Check format, force and slew rate of commands that are played once, starting from zero force. Raises
    `DeviceError` for commands that are not within the limits."""
    _check_forces(commands, limits, rate_hz)
    _check_steps(np.diff(commands.samples, axis=0, prepend=0.0), limits, rate_hz)


def _check_forces(force: Signal, limits: Limits, rate_hz: float) -> None:
    """Require the device's rate, the shape (n, 3), force in N, finite samples, and norms within the stimulus's cap."""
    if force.sample_rate_hz != rate_hz:
        raise _refusal(f"it was made for {force.sample_rate_hz:g} Hz, the device runs at {rate_hz:g} Hz")
    if force.samples.shape[1] != 3 or not len(force):
        raise _refusal(f"its samples have the shape {force.samples.shape}; it must be (n, 3) with n > 0")
    if (force.quantity, force.unit) != ("force", "N"):
        raise _refusal(f"it is {force.quantity} in {force.unit}; it must be force in N")
    if not np.isfinite(force.samples).all():
        raise _refusal("some of its samples are not numbers")
    peak_n = float(np.linalg.norm(force.samples, axis=1).max())
    if peak_n > limits.stimulus_cap_n * TOLERANCE:
        raise _refusal(f"it reaches {peak_n:.4g} N; the cap of the stimulus is {limits.stimulus_cap_n:g} N")


def _check_steps(steps: FloatArray, limits: Limits, rate_hz: float) -> None:
    """Require steps (n, 3), N per tick, within the slew limit."""
    steepest = float(np.linalg.norm(steps, axis=1).max()) * rate_hz
    if steepest > limits.slew_n_per_s * TOLERANCE:
        raise _refusal(f"it changes by {steepest:.4g} N/s; the slew limit is {limits.slew_n_per_s:g} N/s")


def _check_info(info: DeviceInfo) -> None:
    """Require rate and mass of the device within their ranges: spring, fades and all times in ticks depend on them."""
    ranges = (
        ("sample_rate_hz", info.sample_rate_hz, *RATES_HZ),
        ("effective_mass_kg", info.effective_mass_kg, 1e-3, HEAVIEST_KG),
    )
    for name, value, lowest, highest in ranges:
        if not lowest <= value <= highest:
            raise DeviceError(
                "The device was not opened: it reports implausible properties",
                f"'{info.name}' reports that its {name} is {value:g}; it must lie between {lowest:g} and {highest:g}.",
                "Correct the device's driver or its settings.",
            )


def _check_caps(settings: DeviceSettings, info: DeviceInfo) -> None:
    """Require force caps within the device's maximum and, unless lifted without a hand, within those for a hand."""
    limits, exceeds_hand_ceiling = settings.limits, settings.beyond_hand_ceiling
    if exceeds_hand_ceiling and settings.hand_on_handle:
        raise _settings_error("beyond_hand_ceiling is set while a hand is on the handle.")
    ceiling_n = info.max_force_n if exceeds_hand_ceiling else min(info.max_force_n, HAND_TOTAL_CAP_N)
    stimulus_ceiling_n = ceiling_n if exceeds_hand_ceiling else min(ceiling_n, HAND_STIMULUS_CAP_N)
    _check_within("total_cap_n", limits.total_cap_n, ceiling_n)
    _check_within("feedback_cap_n", limits.feedback_cap_n, ceiling_n if exceeds_hand_ceiling else HAND_TOTAL_CAP_N)
    _check_within("stimulus_cap_n", limits.stimulus_cap_n, min(stimulus_ceiling_n, limits.total_cap_n))


def _check_within(name: str, value: float, highest: float, *, zero: bool = False) -> None:
    """Require 0 < value <= highest, or 0 <= value where `zero`; NaN is refused."""
    if not (0 < value <= highest or (zero and value == 0)):
        allowed = "at least 0" if zero else "above 0"
        raise _settings_error(f"{name} is {value:g}; it must be {allowed} and at most {highest:g}.")


def _settings_error(problem: str) -> DeviceError:
    """Error for settings that are refused. problem: a sentence."""
    return DeviceError(
        "The device was not opened: its limits are not safe",
        problem,
        "Correct the [safety] and [spring] sections of the protocol.",
    )


def _refusal(reason: str) -> DeviceError:
    """Error for a stimulus or commands that are refused. reason: a clause without a full stop."""
    return DeviceError(
        "The device did not play this: it is not within the limits",
        f"Nothing has moved. The stimulus was refused because {reason}.",
        "Correct the protocol or the equalizer's model, or widen the protocol's limits if they are meant to be wider.",
    )
