"""Protocols of studies that are over soon."""

SMALL = """
name = "small"
kind = "study"
title = "A small study for tests"

[stimulus]
frequencies_hz = [25.0, 35.0]
fade_in_s = 0.1
fade_out_s = 0.05

[staircase]
start_n = 1.0
cap_n = 3.0
up_after_wrong = 1
down_after_right = 3
steps = [{ step_db = 4.0, reversals = 2 }, { step_db = 1.0, reversals = 3 }]
reversals = 5
averaged_reversals = 3

[directions]

[safety]
stimulus_cap_n = 3.0
total_cap_n = 4.5

[training]
frequencies_hz = [5.0]
trial_limit = 4

[trial]
pause_between_s = 0.0

[rests]
after_run_s = 2.0

[measurement]
keep_s = 0.2
"""


BRIEF = (
    SMALL.replace("frequencies_hz = [25.0, 35.0]", "frequencies_hz = [25.0]")
    .replace("reversals = 2 }", "reversals = 1 }")
    .replace("reversals = 3 }", "reversals = 1 }")
    .replace("reversals = 5\naveraged_reversals = 3", "reversals = 2\naveraged_reversals = 1")
    .replace("trial_limit = 4", "trial_limit = 2")
)
"""A third of the small protocol: 11 trials, where what is tested does not depend on how many there are."""
