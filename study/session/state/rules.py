"""Rules of a session on void trials, refusals and participant numbers, by version.

A session keeps the version that its opening line names. Version 1 (logs that name none): a void trial is drawn anew, at
every request; a person who refused is asked again when the session is resumed; the participant number is that of the
opening line.

Version 2:

* A void trial is presented again with the same stimulus: direction (or interval), level, polarity. With a new draw on
  request, a participant could ask again whenever unsure and answer when sure; thresholds would be too low by about
  2 dB.
* This holds for every cause of a void trial. Pausing, leaving, Ctrl-C, a late answer, and pushing the handle until the
  safety layer releases it, are open to a participant like the repeat key, and a new draw would have the same effect.
* Only the repeat key is limited (`trial.repeats_per_run`): pausing and leaving are the participant's rights and are
  never refused. Both allow the participant to feel the same stimulus again, which lowers thresholds where it is done
  whenever unsure (by 1.9 to 4.8 dB in simulations without a limit). The rules do not prevent this. Every cause is
  logged, and the analysis flags participants with many void trials (`psychophysics.repeated_trials`), whose runs
  should be left out or repeated.
* Refused consent and exclusion, once confirmed, are final and close the session.
* The place in the counterbalanced order (the participant number) is assigned by an event of its own, after consent,
  exclusion questions and set-up are passed. A person who does not take part has no place.
"""

from typing import Literal

from study.session.facts.events import SessionOpened

LATEST: Literal[2] = 2
"""Version of new sessions."""


def repeats_same_stimulus(opened: SessionOpened) -> bool:
    """Whether a void trial is repeated with the same stimulus."""
    return opened.rules >= 2


def is_refusal_final(opened: SessionOpened) -> bool:
    """Whether a refusal or an exclusion closes the session."""
    return opened.rules >= 2


def is_place_assigned_later(opened: SessionOpened) -> bool:
    """Whether the participant number is assigned after the preparation of the sitting; never for simulated
    participants, who always take part."""
    return opened.rules >= 2 and opened.observer is None
