"""English sentences, by key, that a session composes and logs: requests, causes of void trials, notices.

They are called facts, to distinguish them from the fixed texts of the screens (`english_screens`). The event log
contains them in English. The participant reads them in the language of the protocol, whose table of texts (`de.toml`,
`es.toml`) has the same keys: `words.Words.translate_fact` recognises a sentence and translates it. A name in braces,
such as {seconds}, is replaced by a value. Sentences for the experimenter alone are not listed.
"""

FACTS: dict[str, str] = {
    # Requests, and who made them.
    "fact_pause": "asked for a pause",
    "fact_leave": "asked to leave",
    "fact_pause_participant": "the participant asked for a pause",
    "fact_pause_experimenter": "the experimenter asked for a pause",
    "fact_pause_program": "the program asked for a pause",
    "fact_stop_participant": "the participant stopped the session",
    "fact_stop_experimenter": "the experimenter stopped the session",
    "fact_stop_program": "the program stopped the session",
    "fact_left": "the participant left",
    "fact_withdrew": "the participant withdrew",
    "fact_input_ended": "the input ended",
    # Reasons why a trial is void or a sitting ends.
    "fact_ended_early": "the stimulus ended early",
    "fact_time_limit": "no answer within the time limit",
    "fact_handle_wait": "the wait for the handle ended early",
    "fact_masking": "the masking noise stopped during the trial",
    "fact_both_intervals": "answered before both intervals",
    "fact_reference_cut": "the reference was cut short",
    "fact_screen": "the screen gave no sign of life",
    "fact_screen_late": "the screen gave no sign of life: the computer was too busy",
    "fact_stalled": "the program gave no sign of life, so the force was faded out",
    "fact_missed": "{share} % of the 1 kHz ticks were missed",
    "fact_late": "{share} % of the 1 kHz ticks were late or missed",
    "fact_held": "{milliseconds} ms late was the latest 1 kHz tick",
    "fact_number": "a command or a position was no plausible number",
    "fact_too_long": "the stimulus was held longer than the protocol allows",
    "fact_emergency": "the emergency stop was pressed",
    "fact_lost": "the device stopped answering",
    "fact_force_left": "the device took no zero force: let go of the handle and switch the device off",
    "fact_outside": "the position lay outside the workspace, so the force was let go",
    "fact_jumped": "the position jumped further than a handle can move, so the force was let go",
    "fact_shaken": "the position changed its speed faster than a handle can, so the force was let go",
    "fact_stale": "the position stood still although the handle must have moved, so the force was let go",
    "fact_voids_busy": "the computer is too busy: {trials} trials in a row were void because of it, not because of the "
    "participant (the last because {reason})",
    "fact_voids_perhaps_busy": "{trials} trials in a row were void, the last because {reason}: the computer may be too "
    "busy",
    "fact_voids": "{trials} trials in a row were void, the last because {reason}",
    "fact_longest": "the longest sitting of {minutes} minutes is reached; go on another day",
    "fact_dose": "the hand has got its vibration dose for today (A(8) {dose} of {limit} m/s²); go on another day",
    "fact_refused": "consent was not given",
    "fact_excluded": "a question of the exclusion list was answered with yes",
    "fact_cut_short": "That was cut short: {reason}.",
    # Titles while a stimulus plays, and instructions for the handle.
    "fact_direction": "Direction {number}",
    "fact_interval": "Interval {number}",
    "fact_no_question": "Nothing to answer: the device is measured",
    "fact_no_position": "The device does not say where its handle is.",
    "fact_simulated_device": "simulated {device}",
    "fact_hold_there": "Hold it there.",
    "fact_bring_back": "Bring the handle {distance} mm back to the centre.",
    "fact_hands_off": "Hands off: the reference plays for {seconds} s.",
    # Deviations of the set-up from the protocol.
    "fact_setup": "The set-up is not the protocol's: {differences}.",
    "fact_heard": "the device can be heard",
    "fact_seen": "the hand can be seen",
    "fact_unsupported": "the arm is not supported",
}
"""English text of each fact by its key. A key is part of the format of translations: it must not change."""
