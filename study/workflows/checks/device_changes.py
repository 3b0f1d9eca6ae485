"""Format the changes of a device since its acceptance as findings, with values, limits and advice."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from analysis.wording import format_signed
from study.session.views.participant_views import DeviceFinding

if TYPE_CHECKING:
    from analysis.device_change.compare_measurements import Change

CAUSE_ADVICE = {
    "friction": "Look for a cable that rubs and for dirt in the joints; let the device warm up.",
    "gain": "Look at what was added to the handle, at the power supply, and at the sensor's mounting and calibration.",
    "response": "Look for a loose screw at handle, sensor, base or table, and at the cable.",
    "noise": "Look at the sensor's plug, cable and shield, and at what shakes the table.",
}
"""What to look for after a change, by its kind."""
FRICTION_ADVICE = "That may come from the friction: mend it first."
"""Advice where gain or response changed together with the friction."""
NOISE_ADVICE = "It was measured too inaccurately: close other programs, keep the table still, and check again."
"""Advice where the measurement is too noisy to decide whether there was a change."""
ORIENTATION_ADVICE = (
    "More than 100 % may come from a reversed or exchanged axis of the sensor: first compare its mounting and its "
    "table in the device's file with those at the acceptance."
)
"""Added where a response differs by more than itself, as one of reversed sign does (200 %)."""
PERSISTENCE_ADVICE = "If it persists, name the cause with `hapteq diagnose`, or accept the device anew."
"""Added to each advice of `CAUSE_ADVICE`."""


def make_change_findings(changes: Sequence["Change"]) -> tuple[DeviceFinding, ...]:
    """Make a finding for each kind of change, in the order in which the kinds first occur."""
    kinds = dict.fromkeys(change.kind for change in changes)
    friction_changed = any(change.changed for change in changes if change.kind == "friction")
    return tuple(
        _make_finding(kind, [change for change in changes if change.kind == kind], friction_changed) for kind in kinds
    )


def _make_finding(kind: str, changes: Sequence["Change"], friction_changed: bool) -> DeviceFinding:
    """Make the finding on one kind of change, over all axes: wrong where an axis changed, a warning where noise hides
    whether one changed. friction_changed: whether the friction changed, which may also change gain and response."""
    change_text = f"{'; '.join(_format_change(change) for change in changes)} ({_format_limit(changes[0])})"
    changed_axes_text = ", ".join(change.axis for change in changes if change.changed)
    cause_text = (
        FRICTION_ADVICE
        if friction_changed and kind in ("gain", "response")
        else f"{CAUSE_ADVICE[kind]} {PERSISTENCE_ADVICE}"
    )
    if kind == "response" and any(change.changed and change.today > 1 for change in changes):
        cause_text = f"{ORIENTATION_ADVICE} {cause_text}"
    advice = f"It changed ({changed_axes_text}). {cause_text}"
    if changed_axes_text:
        return DeviceFinding(kind.capitalize(), change_text, fine=False, advice=advice)
    if unclear_axes_text := ", ".join(dict.fromkeys(change.axis for change in changes if change.unclear)):
        return DeviceFinding(
            kind.capitalize(), change_text, False, f"Not told ({unclear_axes_text}). {NOISE_ADVICE}", warning=True
        )
    return DeviceFinding(kind.capitalize(), change_text, fine=True)


def _format_change(change: "Change") -> str:
    """Format axis and size: percent for gain and a measured response, else the present and the accepted value."""
    match change.kind:
        case "gain":
            return f"{change.axis} {format_signed(100 * (change.today - 1), 1)} %"
        case "response" if math.isnan(change.today):
            return f"{change.axis} not measured{_format_band_and_peaks(change)}"
        case "response":
            return f"{change.axis} {100 * change.today:.1f} %{_format_band_and_peaks(change)}"
        case _:
            accepted_text, today_text = _format_value(change.accepted), _format_value(change.today)
            return f"{change.axis} {today_text} {change.unit}, accepted {accepted_text}"


def _format_band_and_peaks(change: "Change") -> str:
    """Format the band (Hz) of a change of the response, and the frequencies of the strongest peak today and at the
    acceptance; empty where no band is stated."""
    if change.band_hz is None:
        return ""
    peak_text = (
        f", strongest at {change.peaks_hz[1]:g} Hz, accepted {change.peaks_hz[0]:g} Hz" if change.peaks_hz else ""
    )
    return f" at {change.band_hz[0]:g} to {change.band_hz[1]:g} Hz{peak_text}"


def _format_limit(change: "Change") -> str:
    """Format the limit of a kind of change: absolute, as a factor, or in percent."""
    match change.kind:
        case "friction":
            return f"may change by {change.limit:g} {change.unit}"
        case "noise":
            return f"may change by a factor of {change.limit:g}"
        case _:
            return f"may change by {100 * change.limit:.0f} %"


def _format_value(value: float) -> str:
    """Format a measured value with three significant digits; words for NaN: the handle did not move."""
    return "the handle did not move" if math.isnan(value) else f"{value:.3g}"
