"""Forms filled in, and a state with all preparations done."""

from study.session.facts.events import (
    DeviceChecked,
    FormFilled,
)
from study.session.state.fold import apply_event

UTC = "2026-01-01T00:00:00.000+00:00"


def filled(form: str, passed: bool = True, **answers: str) -> FormFilled:
    return FormFilled(UTC, form, "3", "EK 7/26", passed, answers)


def prepared(state):
    for event in (filled("consent"), filled("exclusion"), filled("setup"), DeviceChecked(UTC, True, ())):
        state = apply_event(state, event)
    return state
