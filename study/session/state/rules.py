"""The rules of a session around its trials, by version. A session keeps the rules that its opening line names.

Version 1 (logs that name none): a void trial is drawn anew, as often as asked for; a refusal is asked again at resume;
the participant number is that of the opening line.

Version 2:

* A void trial comes again with the SAME stimulus: direction (or interval), level, polarity. A redraw on request
  would let a participant wait for an easy trial: feel, ask again when unsure, answer when sure. Thresholds would then
  be too low by some 2 dB.
* That holds for every cause. A pause, leaving, Ctrl-C, a late answer and a handle pushed until the safety layer lets
  go are available to a participant like the repeat key; a redraw after any of them would have the same effect.
* Only the repeat key is limited (`trial.repeats_per_run`): a pause and leaving are rights, and are never refused. They
  leave a second look at the same stimulus, and as many more as are wanted: a participant who pauses whenever unsure
  lowers the thresholds (by 1.9 to 4.8 dB in simulations without a limit). Nothing here prevents that. Every cause is
  logged, and the analysis flags participants with many (`psychophysics.repeated_trials`): leave such runs out or repeat
  them.
* Refused consent and an exclusion, once confirmed, are final, and close the session.
* A person's place in the balanced order (the participant number) is taken when consent, exclusion questions and
  set-up are passed, by an event of its own. People who do not take part have no place.
"""

from typing import Literal

from study.session.facts.events import SessionOpened

LATEST: Literal[2] = 2
"""Version that new sessions get."""


def same_stimulus_again(opened: SessionOpened) -> bool:
    """Whether a void trial is repeated with the same stimulus."""
    return opened.rules >= 2


def refusal_is_final(opened: SessionOpened) -> bool:
    """Whether refusal or exclusion closes the session."""
    return opened.rules >= 2


def place_comes_later(opened: SessionOpened) -> bool:
    """Whether the participant number is assigned after the preparation. Never for simulated participants, who refuse
    nothing."""
    return opened.rules >= 2 and opened.observer is None
