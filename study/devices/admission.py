"""Checks of the safety layer before anything moves: settings, hardware and stimuli that it refuses, with the reason.

This is the first of two barriers; the second is the control tick (`governor.govern`), which limits every force
independent of these checks. Called by `study.devices.safe`. Reasons for the limits: docs/safety.md.
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

ROUNDING_FACTOR = 1 + 1e-9
"""Factor on caps and slew limit that allows for rounding, for a stimulus exactly at its cap."""

MAX_SETTINGS = {
    "slew_n_per_s": 1e5,
    "longest_hold_s": 600.0,
    "watchdog_s": 5.0,
    "release_s": 1.0,
    "keep_s": 600.0,
}
"""Upper bounds of fields of `Limits`, and of `DeviceSettings.keep_s` (N/s, s). They also apply to settings that do not
come from a validated protocol."""

MAX_PLAUSIBILITY_LIMITS = {
    "workspace_m": 0.5,
    "fastest_m_per_s": 20.0,
    "longest_jump_m": 0.5,
    "acceleration_mps2": 1e4,
    "resolution_m": 1e-3,
    "friction_n": 3.0,
    "stale_s": 5.0,
    "still_s": 60.0,
}
"""Upper bounds of the fields of `Limits.plausibility` (m, m/s, m/s², N, s), as in `protocols.definition.plausibility`;
repeated for settings that do not come from a validated protocol."""

RATES_HZ = (100.0, 10_000.0)
"""Lowest and highest accepted rate of a device's control loop (Hz). Chosen around the usual 1 kHz."""

MAX_EFFECTIVE_MASS_KG = 10.0
"""Largest accepted effective mass (kg), chosen above that of a desktop device. The stiffness of the centring spring is
proportional to the mass that the device reports."""

MAX_FORCE_DROP_S = 1.0
"""Longest accepted time (s) after the last command until the hardware itself drops the force. Chosen."""

SETTINGS_REMEDY = (
    "Correct the [safety] and [spring] sections of the protocol; slew_n_per_s follows from its largest force, highest "
    "frequency and shortest fade."
)
"""Remedy for settings of a protocol that are refused."""

FADE_SHAPES = ("raised_cosine", "linear")
"""Shapes of a stimulus's fades that the control tick implements."""


def check_settings(settings: DeviceSettings, info: DeviceInfo) -> None:
    """Check settings and device before the safety layer uses them. The bounds of spring (10 Hz) and damper (20 N s/m)
    are those of `protocols.definition.apparatus.SpringSettings`. Raises `DeviceError` for a limit outside its bounds or
    not finite, a place outside the workspace, and for a device that reports an implausible rate or mass."""
    _check_info(info)
    limits = settings.limits
    setting_values = {name: getattr(limits, name) for name in MAX_SETTINGS if name != "keep_s"} | {
        "keep_s": settings.keep_s
    }
    for name, value in setting_values.items():
        _check_within(name, value, MAX_SETTINGS[name])
    _check_caps(settings, info)
    for name, max_value in MAX_PLAUSIBILITY_LIMITS.items():
        _check_within(
            f"plausibility.{name}", getattr(limits.plausibility, name), max_value, allows_zero=name == "friction_n"
        )
    _check_within("spring_frequency_hz", settings.spring_frequency_hz, 10.0, allows_zero=True)
    _check_within("spring_damping_n_s_per_m", settings.spring_damping_n_s_per_m, 20.0, allows_zero=True)
    workspace_m = limits.plausibility.workspace_m
    if not math.hypot(*settings.place_m) <= workspace_m:  # NaN is refused too
        raise _make_settings_error(
            f"place_m is {settings.place_m}; it must lie within {workspace_m:g} m of the origin, the workspace_m of "
            "the protocol. Beyond it the spring would pull the handle out of the workspace.",
            "Give a place in metres that lies in the workspace.",
        )


def check_hardware(drops_force_after_s: float, info: DeviceInfo, settings: DeviceSettings) -> None:
    """Check that the hardware drops its force by itself within `MAX_FORCE_DROP_S`. drops_force_after_s: time (s) from
    the last command until it does; 0 or infinite: never. Raises `DeviceError` for a real device in a hand that does
    not; a simulated device, or one without a hand, is always accepted."""
    if info.simulated or not settings.hand_on_handle or 0 < drops_force_after_s <= MAX_FORCE_DROP_S:
        return
    raise DeviceError(
        "The device was not opened: it has no watchdog",
        f"If this program were killed, '{info.name}' would hold its last force (drops_force_after_s is "
        f"{drops_force_after_s:g}; it must be above 0 and at most {MAX_FORCE_DROP_S:g}).",
        "Switch the watchdog in the device's firmware on, or use it without a hand on the handle.",
    )


def check_stimulus(stimulus: HeldStimulus, limits: Limits, rate_hz: float) -> None:
    """Check fades (known shape, 0 to 10 s, chosen), format, force and slew rate of a repeated stimulus. Its slew rate
    includes the steps from the loop's last sample to its first and, with an onset, from zero through the onset into the
    loop; with neither onset nor fade-in, or one of a single tick, from zero to the first sample at full strength.
    rate_hz: rate of the device. Raises `DeviceError` for a stimulus that is not within the limits."""
    if stimulus.fade_shape not in FADE_SHAPES:
        raise _make_refusal_error(f"its fade shape is {stimulus.fade_shape!r}; known are {' and '.join(FADE_SHAPES)}")
    for setting_name, fade_s in (("fade_in_s", stimulus.fade_in_s), ("fade_out_s", stimulus.fade_out_s)):
        if not 0 <= fade_s <= 10:
            raise _make_refusal_error(f"its {setting_name} is {fade_s}; it must lie between 0 and 10 s")
    _check_forces(stimulus.loop, limits, rate_hz)
    samples = stimulus.loop.samples
    _check_steps(np.diff(samples, axis=0, append=samples[:1]), limits, rate_hz)
    if stimulus.onset is not None:
        _check_forces(stimulus.onset, limits, rate_hz)
        _check_steps(np.diff(stimulus.onset.samples, axis=0, prepend=0.0, append=samples[:1]), limits, rate_hz)
    elif (fade_ticks := round(stimulus.fade_in_s * rate_hz)) <= 1:  # from zero to the full force within a tick
        _check_steps(samples[[fade_ticks % len(samples)]], limits, rate_hz)


def check_commands(commands: Signal, limits: Limits, rate_hz: float) -> None:
    """Check format, force and slew rate of commands that are played once, starting from zero force. rate_hz: rate of
    the device. Raises `DeviceError` for commands that are not within the limits."""
    _check_forces(commands, limits, rate_hz)
    _check_steps(np.diff(commands.samples, axis=0, prepend=0.0), limits, rate_hz)


def _check_forces(force: Signal, limits: Limits, rate_hz: float) -> None:
    """Require the device's rate, the shape (n, 3), force in N, finite samples, and norms within the stimulus's cap.
    Raises `DeviceError`."""
    if force.sample_rate_hz != rate_hz:
        raise _make_refusal_error(f"it was made for {force.sample_rate_hz:g} Hz, the device runs at {rate_hz:g} Hz")
    if force.samples.shape[1] != 3 or not len(force):
        raise _make_refusal_error(f"its samples have the shape {force.samples.shape}; it must be (n, 3) with n > 0")
    if (force.quantity, force.unit) != ("force", "N"):
        raise _make_refusal_error(f"it is {force.quantity} in {force.unit}; it must be force in N")
    if not np.isfinite(force.samples).all():
        raise _make_refusal_error("some of its samples are not numbers")
    peak_n = float(np.linalg.norm(force.samples, axis=1).max())
    if peak_n > limits.stimulus_cap_n * ROUNDING_FACTOR:
        raise _make_refusal_error(f"it reaches {peak_n:.4g} N; the cap of the stimulus is {limits.stimulus_cap_n:g} N")


def _check_steps(steps: FloatArray, limits: Limits, rate_hz: float) -> None:
    """Require the norms of the steps (n, 3), N per tick, within the slew limit (N/s). Raises `DeviceError`."""
    max_slew_n_per_s = float(np.linalg.norm(steps, axis=1).max()) * rate_hz
    if max_slew_n_per_s > limits.slew_n_per_s * ROUNDING_FACTOR:
        raise _make_refusal_error(
            f"it changes by {max_slew_n_per_s:.4g} N/s; the slew limit is {limits.slew_n_per_s:g} N/s"
        )


def _check_info(info: DeviceInfo) -> None:
    """Require rate and mass of the device within their ranges, because spring, fades and all times in ticks depend on
    them. Raises `DeviceError`."""
    accepted_ranges = (
        ("sample_rate_hz", info.sample_rate_hz, *RATES_HZ),
        ("effective_mass_kg", info.effective_mass_kg, 1e-3, MAX_EFFECTIVE_MASS_KG),
    )
    for name, value, lowest, highest in accepted_ranges:
        if not lowest <= value <= highest:
            raise DeviceError(
                "The device was not opened: it reports implausible properties",
                f"'{info.name}' reports that its {name} is {value:g}; it must lie between {lowest:g} and {highest:g}.",
                "Correct the device's driver or its settings.",
            )


def _check_caps(settings: DeviceSettings, info: DeviceInfo) -> None:
    """Require the caps (N) on total and stimulus within the device's maximum and, unless `beyond_hand_ceiling`, those
    for a hand; the stimulus's within the total; the cap on the feedback within the device's maximum where
    `beyond_hand_ceiling`, else within that for a hand. Refuse `beyond_hand_ceiling` with a hand on the handle. Raises
    `DeviceError`."""
    limits, exceeds_hand_ceiling = settings.limits, settings.beyond_hand_ceiling
    if exceeds_hand_ceiling and settings.hand_on_handle:
        raise _make_settings_error("beyond_hand_ceiling is set while a hand is on the handle.")
    ceiling_n = info.max_force_n if exceeds_hand_ceiling else min(info.max_force_n, HAND_TOTAL_CAP_N)
    stimulus_ceiling_n = ceiling_n if exceeds_hand_ceiling else min(ceiling_n, HAND_STIMULUS_CAP_N)
    _check_within("total_cap_n", limits.total_cap_n, ceiling_n)
    _check_within("feedback_cap_n", limits.feedback_cap_n, ceiling_n if exceeds_hand_ceiling else HAND_TOTAL_CAP_N)
    _check_within("stimulus_cap_n", limits.stimulus_cap_n, min(stimulus_ceiling_n, limits.total_cap_n))


def _check_within(name: str, value: float, max_value: float, *, allows_zero: bool = False) -> None:
    """Require 0 < value <= max_value, or 0 <= value <= max_value where `allows_zero`. Raises `DeviceError`, also for
    NaN."""
    if not (0 < value <= max_value or (allows_zero and value == 0)):
        allowed_text = "at least 0" if allows_zero else "above 0"
        raise _make_settings_error(f"{name} is {value:g}; it must be {allowed_text} and at most {max_value:g}.")


def _make_settings_error(problem: str, remedy: str = SETTINGS_REMEDY) -> DeviceError:
    """Make the error for settings that are refused. problem, remedy: sentences."""
    return DeviceError("The device was not opened: its limits are not safe", problem, remedy)


def _make_refusal_error(reason: str) -> DeviceError:
    """Make the error for a stimulus or commands that are refused. reason: a clause without a full stop."""
    return DeviceError(
        "The device did not play this: it is not within the limits",
        f"Nothing has moved. The stimulus was refused because {reason}.",
        "Correct the protocol or the equalizer's model, or widen the protocol's limits if they are meant to be wider.",
    )
