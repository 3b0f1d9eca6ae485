"""Settings of a diagnosis: effects to consider, signals to compare, time limit. The limits that decide are in
`limits.py`."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from analysis.diagnosis.errors.choose_measure import Compared
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.time_budget import grant_time
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.law_entry import LawEntry
from equalizer.signals.recording import Recording

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


BALANCE = "the force balance"
"""Name of the force balance in the remark that it crashed."""


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    """Settings of one diagnosis. The defaults differ from those of the command `hapteq diagnose`, which has `discovery`
    and `guard` on."""

    without: tuple[str, ...] = ()
    """Names of effects that are left out."""
    names: tuple[str, ...] = ()
    """Names of the recordings in the findings; empty: recording 1, recording 2 and so on."""
    clean: tuple[Recording, ...] = ()
    """Recordings of the device without the fault. The error of the re-tuned model there does not count as mismatch."""
    fitted: bool = False
    """Whether the program fitted the model, to these recordings or to `clean`. Without `clean`, laws are then tested in
    the force balance first."""
    balances: "tuple[Balance, ...] | None" = None
    """Result of `find_balances` for these recordings, where it is known already; None = it is computed."""
    compared: Compared = "auto"
    """Compared quantity: motion or force; "auto" = chosen by `errors.choose_measure`."""
    discovery: bool = False
    """Whether laws are discovered where no effect of the catalogue is named."""
    kept: tuple[LawEntry, ...] = ()
    """Laws discovered in other recordings, tried in addition to the catalogue."""
    time_left: TimeBudget = grant_time
    """Whether there is time left; called before each step of the search. Once it returns False, the search ends with
    the result so far."""
    guard: Guard = field(default_factory=Guard)
    """If on, an effect that crashes is left out, with a remark; if off, the exception is raised."""
