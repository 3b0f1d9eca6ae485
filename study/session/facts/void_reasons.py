"""Reasons for void trials that the computer caused, as they are logged and shown, and the sentences made of them.

A computer that is too busy delays the 1 kHz control loop or the screen; such trials are void and repeated. That the
computer was the cause is recognised by the text of the logged reason (`is_computer_busy`).
"""

SCREEN_SILENT = "the screen gave no sign of life"
"""The screen process was suspended, hung, or waited for a processor; which of these is unknown."""
SCREEN_LATE = f"{SCREEN_SILENT}: the computer was too busy"
"""As `SCREEN_SILENT`, where the load of the computer or the delay of the engine shows the cause."""
PROGRAM_STALLED = "the program gave no sign of life, so the force was faded out"
"""The process of the session gave no sign of life within the device's limit `watchdog_s`."""
TICKS_MISSED = "of the 1 kHz ticks were missed"
TICKS_LATE = "of the 1 kHz ticks were late or missed"
TICK_HELD = "late was the latest 1 kHz tick"
"""Ends of the reasons for missed or late ticks; the logged reason begins with the share or the delay."""

ACCELERATION_MISSING = "of the acceleration is missing"
"""End of the reason, which begins with the missing share: packets of the accelerometer were lost or garbled."""

HARDLY_ARRIVED = "less motion arrived than any hand leaves of the force"
"""Remark on a trial that counts; possible causes: motors without force, a blocked handle, a defective
accelerometer."""

LOAD_PER_PROCESSOR = 0.75
"""Load average per processor above which tasks often have to wait for a processor."""

ENGINE_LATE_S = 0.1
"""A delay of the engine's own wake-up (s) that shows a busy computer: more than twice the polling interval."""


def explain_silent_screen(engine_late_s: float, load_per_processor: float | None) -> str:
    """The reason to log for a silent screen. engine_late_s: delay of the engine's own wake-up (s); load_per_processor:
    load average per processor, None if unknown."""
    loaded = load_per_processor is not None and load_per_processor > LOAD_PER_PROCESSOR
    return SCREEN_LATE if loaded or engine_late_s >= ENGINE_LATE_S else SCREEN_SILENT


def is_computer_busy(reason: str) -> bool:
    """Whether this reason states that the computer was too busy; False also where the cause is unknown."""
    return reason in (SCREEN_LATE, PROGRAM_STALLED) or reason.endswith((TICKS_MISSED, TICKS_LATE, TICK_HELD))


TOO_BUSY = "the computer is too busy"
"""Beginning of the reason for ending a sitting whose void trials the computer caused."""


def explain_many_voids(reasons: tuple[str, ...]) -> str:
    """Reason why a sitting ends after several void trials in a row. reasons: of these trials, at least one."""
    void_text = f"{len(reasons)} trials in a row were void"
    if all(map(is_computer_busy, reasons)):
        return f"{TOO_BUSY}: {void_text} because of it, not because of the participant (the last because {reasons[-1]})"
    if all(is_computer_busy(reason) or reason == SCREEN_SILENT for reason in reasons):
        return f"{void_text}, the last because {reasons[-1]}: the computer may be too busy"
    return f"{void_text}, the last because {reasons[-1]}"


def describe_busy_voids(voids: int) -> str:
    """Summary for the experimenter at the end of a sitting. voids: number of trials void because of a busy computer."""
    trials = "1 trial was" if voids == 1 else f"{voids} trials were"
    return (
        f"The computer was too busy: {trials} void because of it in this sitting and repeated. Close other programs; "
        "hapteq doctor measures how late it is."
    )
