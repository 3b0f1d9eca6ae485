"""Reasons for which a trial is void or remarked on: the texts that are logged and shown, and sentences made of them.

A computer that is too busy delays the 1 kHz control loop or the screen; trials that are void for this reason are
repeated. `is_computer_busy` recognises this cause by the text of the logged reason; therefore the texts must not
change.
"""

SCREEN_UNRESPONSIVE = "the screen gave no sign of life"
"""The screen process did not respond: it was suspended, hung, or waited for a processor; which of these is unknown."""
SCREEN_DELAYED_BY_LOAD = f"{SCREEN_UNRESPONSIVE}: the computer was too busy"
"""As `SCREEN_UNRESPONSIVE`, where the load of the computer or the delay of the engine shows the cause."""
PROGRAM_STALLED = "the program gave no sign of life, so the force was faded out"
"""The program did not act in time while a force was on: the session process did not reset the watchdog of the device
within its time limit `watchdog_s`, and the force was faded out; or the control loop itself stood still (a suspended
process, a computer that is too busy, an interruption within a tick), and it or the hardware's watchdog switched the
force off at once. Logs have this text for all of them."""
TICKS_MISSED = "of the 1 kHz ticks were missed"
"""End of the reason, which begins with the share of missed ticks of the control loop in percent."""
TICKS_LATE = "of the 1 kHz ticks were late or missed"
"""End of the reason, which begins with the share of late or missed ticks in percent."""
LATEST_TICK_LATE = "late was the latest 1 kHz tick"
"""End of the reason, which begins with the delay of the latest tick in ms."""

ACCELERATION_MISSING = "of the acceleration is missing"
"""End of the reason, which begins with the missing share in percent: packets of the accelerometer were lost or
corrupted."""

TOO_LITTLE_MOTION = "less motion arrived than any hand leaves of the force"
"""Remark on a trial that counts: the measured motion is less than the stimulus force causes with any impedance of the
hand. Possible causes: motors without force, a blocked handle, a defective accelerometer."""

LOAD_PER_PROCESSOR = 0.75
"""Load average per processor above which tasks often have to wait for a processor. Chosen by hand."""

ENGINE_LATE_S = 0.1
"""Least delay (s) of a wake-up of the session process that shows a busy computer. Chosen: 2.5 times the interval
at which it polls the screen (`remote_display.KEEPALIVE_INTERVAL_S`)."""


def explain_silent_screen(engine_late_s: float, load_per_processor: float | None) -> str:
    """Return the reason to log where the screen process did not respond. engine_late_s: longest delay (s) of a wake-up
    of the session process; load_per_processor: load average per processor, None if unknown."""
    is_loaded = load_per_processor is not None and load_per_processor > LOAD_PER_PROCESSOR
    return SCREEN_DELAYED_BY_LOAD if is_loaded or engine_late_s >= ENGINE_LATE_S else SCREEN_UNRESPONSIVE


def is_computer_busy(reason: str) -> bool:
    """Whether a logged reason has a busy computer as its cause; False also where the cause is unknown."""
    return reason in (SCREEN_DELAYED_BY_LOAD, PROGRAM_STALLED) or reason.endswith(
        (TICKS_MISSED, TICKS_LATE, LATEST_TICK_LATE)
    )


TOO_BUSY = "the computer is too busy"
"""Beginning of the reason for ending a sitting in which a busy computer caused all the last void trials."""


def explain_many_voids(reasons: tuple[str, ...]) -> str:
    """Return the reason why a sitting ends after several void trials in a row. reasons: logged reasons of these trials,
    at least one."""
    void_text = f"{len(reasons)} trials in a row were void"
    if all(map(is_computer_busy, reasons)):
        return f"{TOO_BUSY}: {void_text} because of it, not because of the participant (the last because {reasons[-1]})"
    if all(is_computer_busy(reason) or reason == SCREEN_UNRESPONSIVE for reason in reasons):
        return f"{void_text}, the last because {reasons[-1]}: the computer may be too busy"
    return f"{void_text}, the last because {reasons[-1]}"


def describe_busy_voids(void_count: int) -> str:
    """Return a summary for the experimenter at the end of a sitting. void_count: number of trials that were void
    because of a busy computer."""
    phrase = "1 trial was" if void_count == 1 else f"{void_count} trials were"
    return (
        f"The computer was too busy: {phrase} void because of it in this sitting and repeated. Close other programs; "
        "hapteq doctor measures how late it is."
    )
