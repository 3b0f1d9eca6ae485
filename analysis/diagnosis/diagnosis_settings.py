"""Settings of a diagnosis: effects to consider, signals to compare, time limit."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from analysis.diagnosis.errors.choose_measure import Compared
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.time_budget import always
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.law_entry import LawEntry
from equalizer.signals.recording import Recording

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


BALANCE = "the force balance"
"""Name of the force balance in a remark about its crash."""


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    """Settings of one diagnosis; the defaults are those of `hapteq diagnose`, but that this discovers laws too."""

    without: tuple[str, ...] = ()
    """Effects that are not to be considered."""
    names: tuple[str, ...] = ()
    """Names of the recordings, for the reader."""
    clean: tuple[Recording, ...] = ()
    """Recordings of the device without the fault: its difference from the re-tuned model there is no mismatch."""
    fitted: bool = False
    """The model was fitted to these recordings by the program: laws are then tested in the force balance."""
    balances: "tuple[Balance, ...] | None" = None
    """`find_balances` of these recordings, where known already."""
    compared: Compared = "auto"
    """What is compared: motion, force, or what suits."""
    discovery: bool = False
    """Whether laws are discovered where no effect of the catalogue is named."""
    kept: tuple[LawEntry, ...] = ()
    """Laws discovered elsewhere, to be tried beside the catalogue."""
    time_left: TimeBudget = always
    """Asked before each piece of the search; once it says no, what was found until then stands."""
    guard: Guard = field(default_factory=Guard)
    """Where it is on, an effect that crashes is left out, with a remark."""
