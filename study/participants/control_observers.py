"""Simulated participants without a threshold: controls that an analysis must recognise as such, whose answers do not
depend on the stimulus, and a participant whose answers are right or wrong by a script."""

from dataclasses import dataclass

from study.participants.observer import PerceivedStimulus, Reply
from study.participants.random_draws import draw_response_time_s, draw_uniform


@dataclass(frozen=True, slots=True)
class GuessingObserver:
    """Participant who answers at random."""

    name: str

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Answer 1 or 2 with equal probability."""
        choice_draw, time_draw = draw_uniform(felt, seed, 2)
        return Reply(1 if choice_draw < 0.5 else 2, draw_response_time_s(time_draw))


@dataclass(frozen=True, slots=True)
class AlternatingObserver:
    """Participant who answers 1, 2, 1, 2 throughout the session."""

    name: str

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Answer 1 after an even number of answers in the session, else 2."""
        _, time_draw = draw_uniform(felt, seed, 2)
        return Reply(1 + felt.trials_before % 2, draw_response_time_s(time_draw))


@dataclass(frozen=True, slots=True)
class ConstantObserver:
    """Participant who always gives the same answer, 1 or 2."""

    name: str
    answer: int
    """The answer, 1 or 2."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        _, time_draw = draw_uniform(felt, seed, 2)
        return Reply(self.answer, draw_response_time_s(time_draw))


@dataclass(frozen=True, slots=True)
class ScriptedObserver:
    """Participant whose answers are right or wrong by the indices of run and trial only. Tests compare the levels of
    interrupted and uninterrupted sessions, which must therefore be equal."""

    name: str
    script: str = "111111011101110011111101110011101110"
    """1 = right, 0 = wrong; repeated from its beginning after its end, and begun one character later in every run. The
    default completes a published staircase at its 36th answer in run 0, slightly earlier or later in other runs."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Answer by the character of the script at run + trial, modulo its length. The repetition of a void trial gets
        the same answer."""
        _, time_draw = draw_uniform(felt, seed, 2)
        is_correct = self.script[(felt.run + felt.trial) % len(self.script)] == "1"
        return Reply(felt.direction_shown if is_correct else 3 - felt.direction_shown, draw_response_time_s(time_draw))
