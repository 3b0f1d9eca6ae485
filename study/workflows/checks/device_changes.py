"""Changes of a device since its acceptance, as findings with numbers and limits."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from analysis.wording import format_signed
from study.session.views.views import DeviceFinding

if TYPE_CHECKING:
    from analysis.device_change.compare_devices import Change

CAUSES = {
    "friction": "Look for a cable that rubs and for dirt in the joints; let the device warm up.",
    "gain": "Look at what was added to the handle, at the power supply, and at the sensor's mounting and calibration.",
    "response": "Look for a loose screw at handle, sensor, base or table, and at the cable.",
    "noise": "Look at the sensor's plug, cable and shield, and at what shakes the table.",
}
"""What to look for, by the kind of change."""
FRICTION_FIRST = "That may come from the friction: mend it first."
"""Advice where gain or response changed together with the friction."""
TOO_NOISY = "It was measured too inaccurately: close other programs, keep the table still, and check again."
"""Advice where a change could not be told."""
IF_IT_STAYS = "If it persists, name the cause with `hapteq diagnose`, or accept the device anew."
"""Added to the advice of `CAUSES`."""


def change_findings(changes: Sequence["Change"]) -> tuple[DeviceFinding, ...]:
    """One for each kind, in the order in which they come."""
    kinds = dict.fromkeys(change.kind for change in changes)
    friction_changed = any(change.changed for change in changes if change.kind == "friction")
    return tuple(
        _finding(kind, [change for change in changes if change.kind == kind], friction_changed) for kind in kinds
    )


def _finding(kind: str, changes: Sequence["Change"], friction_changed: bool) -> DeviceFinding:
    """The line on one kind of change. friction_changed: whether the friction changed, too, which also changes gain and
    response."""
    value = f"{'; '.join(_change_text(change) for change in changes)} ({_limit_words(changes[0])})"
    axes = ", ".join(change.axis for change in changes if change.changed)
    causes = FRICTION_FIRST if friction_changed and kind in ("gain", "response") else f"{CAUSES[kind]} {IF_IT_STAYS}"
    advice = f"It changed ({axes}). {causes}"
    if axes:
        return DeviceFinding(kind.capitalize(), value, fine=False, advice=advice)
    if unclear_axes := ", ".join(dict.fromkeys(change.axis for change in changes if change.unclear)):
        return DeviceFinding(kind.capitalize(), value, False, f"Not told ({unclear_axes}). {TOO_NOISY}", warning=True)
    return DeviceFinding(kind.capitalize(), value, fine=True)


def _change_text(change: "Change") -> str:
    match change.kind:
        case "gain":
            return f"{change.axis} {format_signed(100 * (change.today - 1), 1)} %"
        case "response" if math.isnan(change.today):
            return f"{change.axis} not measured{_place_words(change)}"
        case "response":
            return f"{change.axis} {100 * change.today:.1f} %{_place_words(change)}"
        case _:
            accepted_text, today_text = _number(change.accepted), _number(change.today)
            return f"{change.axis} {today_text} {change.unit}, accepted {accepted_text}"


def _place_words(change: "Change") -> str:
    if change.band_hz is None:
        return ""
    peak_text = (
        f", strongest at {change.peaks_hz[1]:g} Hz, accepted {change.peaks_hz[0]:g} Hz" if change.peaks_hz else ""
    )
    return f" at {change.band_hz[0]:g} to {change.band_hz[1]:g} Hz{peak_text}"


def _limit_words(change: "Change") -> str:
    match change.kind:
        case "friction":
            return f"may change by {change.limit:g} {change.unit}"
        case "noise":
            return f"may change by a factor of {change.limit:g}"
        case _:
            return f"may change by {100 * change.limit:.0f} %"


def _number(value: float) -> str:
    return "the handle did not move" if math.isnan(value) else f"{value:.3g}"
