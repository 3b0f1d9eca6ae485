"""Reasons for void trials that the computer caused: as logged, and as participant and experimenter read them."""

SCREEN_SILENT = "the screen gave no sign of life"
"""The screen process may have been suspended, hung, or waiting for a processor; the cause is unknown."""
SCREEN_LATE = f"{SCREEN_SILENT}: the computer was too busy"
"""`SCREEN_SILENT`, where load or the engine's own lateness shows the cause."""
PROGRAM_STALLED = "the program gave no sign of life, so the force was faded out"
"""The session's process gave no sign of life within `watchdog_s`."""
TICKS_MISSED = "of the 1 kHz ticks were missed"
TICKS_LATE = "of the 1 kHz ticks were late or missed"
TICK_HELD = "late was the latest 1 kHz tick"
"""Ends of the reason, after the figure."""

ACCELERATION_MISSING = "of the acceleration is missing"
"""End of the reason, after the figure: packets of the accelerometer were lost, torn or garbled."""

HARDLY_ARRIVED = "less motion arrived than any hand leaves of the force"
"""Remark on a trial that counts: motors that do nothing, a blocked handle, or a dead accelerometer."""

LOAD_PER_PROCESSOR = 0.75
"""Load average per processor above which tasks often have to wait for a processor."""

ENGINE_LATE_S = 0.1
"""A delay of the engine's own wake-up (s) that shows a busy computer: more than twice the polling interval."""


def why_screen_silent(engine_late_s: float, load_per_processor: float | None) -> str:
    """The reason to log. engine_late_s: how late the engine itself woke up; load_per_processor: None if unknown."""
    loaded = load_per_processor is not None and load_per_processor > LOAD_PER_PROCESSOR
    return SCREEN_LATE if loaded or engine_late_s >= ENGINE_LATE_S else SCREEN_SILENT


def computer_too_busy(reason: str) -> bool:
    """Whether this reason says that the computer was too busy; False also if unknown."""
    return reason in (SCREEN_LATE, PROGRAM_STALLED) or reason.endswith((TICKS_MISSED, TICKS_LATE, TICK_HELD))


TOO_BUSY = "the computer is too busy"
"""Beginning of the reason for ending a sitting whose void trials the computer caused."""


def why_too_many(reasons: tuple[str, ...]) -> str:
    """Why a sitting ends after several void trials in a row."""
    many = f"{len(reasons)} trials in a row were void"
    if all(map(computer_too_busy, reasons)):
        return f"{TOO_BUSY}: {many} because of it, not because of the participant (the last because {reasons[-1]})"
    if all(computer_too_busy(reason) or reason == SCREEN_SILENT for reason in reasons):
        return f"{many}, the last because {reasons[-1]}: the computer may be too busy"
    return f"{many}, the last because {reasons[-1]}"


def busy_sentence(voids: int) -> str:
    """Summary for the experimenter at the end of a sitting."""
    trials = "1 trial was" if voids == 1 else f"{voids} trials were"
    return (
        f"The computer was too busy: {trials} void because of it in this sitting and repeated. Close other programs; "
        "hapteq doctor measures how late it is."
    )
