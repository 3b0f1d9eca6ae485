"""Data dictionary of exported trials: meaning and unit of each column of `trials.csv`, one row per presentation.

The exports write this dictionary with the table, so that a reader needs no other document.
"""

TRIAL_COLUMNS: dict[str, tuple[str, str]] = {
    "subject": ("Code of the participant", ""),
    "session": ("Name of the session", ""),
    "run": ("Number of the run within the session, from 0: one staircase at one frequency", ""),
    "trial": ("Number of the trial within the run, from 0", ""),
    "attempt": ("Number of the presentation of this trial, from 0; above 0 where the earlier ones were void", ""),
    "phase": ("Part of the session: training, test, detection, or catch trials within the test", ""),
    "frequency_hz": ("Frequency of the sinusoidal stimulus", "Hz"),
    "level_n": (
        "Level of the stimulus: commanded amplitude of the force or, where stimuli are equalized, the larger of the "
        "forces that the directions need for wanted_mps2; it is the level of the staircase unless levels are roved",
        "N",
    ),
    "direction_shown": (
        "Number on the screen, 1 or 2, of the direction that was played, which is the right answer; in a detection "
        "trial, of the interval. Where a protocol exchanges the numbers for half of the participants, angle_deg "
        "gives the direction",
        "",
    ),
    "answer": ("Answer, 1 or 2, counted as in direction_shown; empty without an answer", ""),
    "correct": ("Whether the answer is right; empty without an answer", ""),
    "reversal": ("Whether this trial is a reversal of the staircase", ""),
    "response_time_s": (
        "Time from the start of the stimulus, its fade-in included, to the answer; in detection from the end of the "
        "second interval",
        "s",
    ),
    "delivered_mps2": ("Measured amplitude of the acceleration along the direction", "m/s^2"),
    "off_axis_mps2": ("Measured amplitude of the acceleration orthogonal to the direction", "m/s^2"),
    "displacement_mm": ("Measured amplitude of the handle's displacement along the direction", "mm"),
    "missed_ticks": ("Ticks of the control loop that were missed while the stimulus was played", ""),
    "felt": ("False where a person answered while no device moved; empty for simulated participants", ""),
    "status": (
        "ok; flagged: counts, but its stimulus should be inspected; unmeasured: counts, but its stimulus was not "
        "measured; spoiled: void, and presented again; open: not answered yet",
        "",
    ),
    "angle_deg": ("Angle of the direction in the plane of the protocol's directions", "deg"),
    "wanted_mps2": ("Acceleration that the level stands for, where stimuli are equalized", "m/s^2"),
    "void_cause": ("Why this presentation is void; empty where it counts", ""),
    "repeat_cause": ("Why this trial is presented again; empty for a first attempt", ""),
    "late_ticks": ("Ticks of the control loop whose work ended after the next was due; missed ones not counted", ""),
    "latest_s": ("Longest time from when a tick of the control loop was due until its work was done", "s"),
    "onset_s": ("Time from the opening of the session to right before the device moved, by the wall clock", "s"),
    "harmonics_mps2": ("Measured amplitude of the acceleration at 2 to 5 times the frequency, all axes", "m/s^2"),
    "nominal_n": ("Level of the staircase, around which level_n was drawn; empty where nothing is roved", "N"),
    "lost_packets": ("Packets of the accelerometer that were lost or arrived damaged", ""),
    "garbled_bytes": ("Bytes from the accelerometer that belonged to no whole packet", ""),
    "acceleration_missing": ("Share of the packets, or of the recorded ticks, without an acceleration", ""),
}
"""(meaning, unit) by column; the unit is empty for a quantity without one. The keys are the fields of
`protocols.trial.Trial`."""
