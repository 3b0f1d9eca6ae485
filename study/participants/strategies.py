"""Simulated participants who answer without feeling anything: controls that an analysis must recognise, and a
participant with scripted answers."""

from dataclasses import dataclass

from study.participants.chance import draw_response_time_s, draw_uniform
from study.participants.observer import PerceivedStimulus, Reply


@dataclass(frozen=True, slots=True)
class Guesser:
    """Answers at random."""

    name: str

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """1 or 2 with equal probability."""
        choice_draw, time_draw = draw_uniform(felt, seed, 2)
        return Reply(1 if choice_draw < 0.5 else 2, draw_response_time_s(time_draw))


@dataclass(frozen=True, slots=True)
class Alternator:
    """Answers 1, 2, 1, 2 throughout the session."""

    name: str

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """1 after an even number of answers in the session, else 2."""
        _, time_draw = draw_uniform(felt, seed, 2)
        return Reply(1 + felt.trials_before % 2, draw_response_time_s(time_draw))


@dataclass(frozen=True, slots=True)
class Constant:
    """Always gives the same answer."""

    name: str
    answer: int

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The same answer to every stimulus."""
        _, time_draw = draw_uniform(felt, seed, 2)
        return Reply(self.answer, draw_response_time_s(time_draw))


@dataclass(frozen=True, slots=True)
class Scripted:
    """Answers right or wrong by run and trial number only, for any direction drawn. The levels of an interrupted
    session must therefore equal those of an uninterrupted one."""

    name: str
    script: str = "111111011101110011111101110011101110"
    """1 = right, 0 = wrong; repeated, and begun one place later in every run. The default ends a published staircase at
    its 36th answer in run 0, slightly earlier or later in other runs."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The character of the script at run + trial, modulo its length. A repetition of a void trial gets the same
        answer."""
        _, time_draw = draw_uniform(felt, seed, 2)
        is_right = self.script[(felt.run + felt.trial) % len(self.script)] == "1"
        return Reply(felt.direction_shown if is_right else 3 - felt.direction_shown, draw_response_time_s(time_draw))
