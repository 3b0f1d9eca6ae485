"""The gate before a trial: nothing is played until the handle is near its place, and stays there."""

import math
from collections.abc import Callable

from protocols.definition.apparatus import Plane
from protocols.definition.exposure import GateSettings
from study.session.state.state import SessionState
from study.session.stimulus.stimulus import AXES
from study.session.views.views import HandleView, Unanswered
from study.workflows.trial.sitting import Sitting


def await_handle(state: SessionState, sitting: Sitting) -> Unanswered | None:
    """None when a trial may start; else why the wait was cut short."""
    gate = state.protocol.gate
    if gate.radius_mm <= 0:
        return None
    look = _looking(gate, state.protocol.directions.plane, sitting)
    if gate.still_s <= 0 and look().ready:
        return None
    sitting.attendant.begin("waiting for the handle")
    reply = sitting.display.await_handle(look, sitting.attendant.glance)
    sitting.attendant.handle_is(True)
    if reply is None and not look().ready:
        reply = Unanswered("the wait for the handle ended early", leave=False)
    if reply is None:
        return None
    resolved = sitting.attendant.resolve(reply)
    return resolved if isinstance(resolved, Unanswered) else None


def _looking(gate: GateSettings, plane: Plane, sitting: Sitting) -> Callable[[], HandleView]:
    inside_since_s: list[float] = []

    def look() -> HandleView:
        offset = sitting.attendant.offset_m(sitting.device.look())
        now_s = sitting.clock.now_s()
        if offset is None:
            inside_since_s.clear()
            sitting.attendant.handle_is(False)
            return HandleView(False, "The device does not say where its handle is.", (0.0, 0.0), gate.radius_mm)
        distance_mm = 1000.0 * math.hypot(*offset)
        inside = distance_mm <= gate.radius_mm
        if not inside:
            inside_since_s.clear()
        elif not inside_since_s:
            inside_since_s.append(now_s)
        sitting.attendant.handle_is(inside)
        ready = inside and now_s - inside_since_s[0] >= gate.still_s
        first, second = AXES[plane]
        return HandleView(
            ready,
            "Hold it there." if inside else f"Bring the handle {distance_mm:.0f} mm back to the centre.",
            (1000.0 * offset[first], 1000.0 * offset[second]),
            gate.radius_mm,
        )

    return look
