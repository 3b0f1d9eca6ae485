"""Rules of a session on void trials, refusals and participant numbers, by version of the rules.

The event that opens a session states the version, and the session keeps it.

Version 1 (older logs, which state none): a void trial is presented with newly drawn direction and polarity, as often as
requested; a person who refused is asked again when the session is resumed; the participant number is that of the
opening event.

Version 2:

* A void trial is presented again with the same stimulus: direction (or interval), level, polarity. With a new draw on
  request, a participant could ask again when unsure and answer when sure: thresholds were then too low by about 2 dB
  in a simulation without a limit (`tests/study/session/test_repeats_at_will.py`). The same stimulus alone does not
  prevent this, because its presentations add up; the limit on repeats does: 2.2 dB too low without it, 0.4 dB with
  three repeats in a run (docs/statistics.md, "Repeats").
* This holds for every cause of a void trial. Pausing, leaving, Ctrl-C, a late answer, and pushing the handle until the
  safety layer releases it, are available to a participant like the repeat key; a new draw would have the same effect.
* Only the repeat key is limited (`trial.repeats_per_run`): pausing and leaving are the participant's rights and are
  never refused. Both allow the participant to feel the same stimulus again, which lowers thresholds where it is done
  whenever unsure (by 1.9 to 4.8 dB in earlier simulations without a limit, which are not kept; their observers are not
  recorded). The rules do not prevent this. Every cause is logged, and the analysis flags participants with many void
  trials (`analysis.psychophysics.repeated_trials`), whose runs should be left out or repeated.
* Refused consent and exclusion, once confirmed, are final and close the session.
* The place in the counterbalanced order (the participant number) is assigned by the event `PlaceTaken`, after consent,
  exclusion questions, set-up and device check are passed. A person who does not take part has no place.
"""

from typing import Literal

from study.session.facts.events import SessionOpened

LATEST_RULES: Literal[2] = 2
"""Version of the rules for new sessions."""


def is_same_stimulus_repeated(opening_event: SessionOpened) -> bool:
    """Whether a void trial is presented again with the same stimulus instead of a new draw."""
    return opening_event.rules >= 2


def is_refusal_final(opening_event: SessionOpened) -> bool:
    """Whether a refusal of consent or an exclusion is final and closes the session."""
    return opening_event.rules >= 2


def is_place_assigned_later(opening_event: SessionOpened) -> bool:
    """Whether the participant number is assigned after the preparation of the sitting; never for simulated
    participants, who always take part."""
    return opening_event.rules >= 2 and opening_event.observer is None
