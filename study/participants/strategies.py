"""Simulated participants who answer without feeling anything: controls that an analysis must recognise, and a
participant with scripted answers."""

from dataclasses import dataclass

from study.participants.chance import response_time_s, uniform
from study.participants.observer import PerceivedStimulus, Reply


@dataclass(frozen=True, slots=True)
class Guesser:
    """Answers at random."""

    name: str

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """1 or 2 with equal probability."""
        luck, delay = uniform(felt, seed, 2)
        return Reply(1 if luck < 0.5 else 2, response_time_s(delay))


@dataclass(frozen=True, slots=True)
class Alternator:
    """Answers 1, 2, 1, 2 throughout the session."""

    name: str

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """1 after an even number of answers in the session, else 2."""
        _, delay = uniform(felt, seed, 2)
        return Reply(1 + felt.trials_before % 2, response_time_s(delay))


@dataclass(frozen=True, slots=True)
class Constant:
    """Always gives the same answer."""

    name: str
    answer: int

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The same answer to every stimulus."""
        _, delay = uniform(felt, seed, 2)
        return Reply(self.answer, response_time_s(delay))


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
        _, delay = uniform(felt, seed, 2)
        right = self.script[(felt.run + felt.trial) % len(self.script)] == "1"
        return Reply(felt.direction_shown if right else 3 - felt.direction_shown, response_time_s(delay))
