"""Data class of the first model: what a diagnosis starts from where the user gave no model (`fit_without_model`)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from equalizer.plant.mechanical_model import MechanicalModel

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


@dataclass(frozen=True, slots=True, eq=False)
class FirstModel:
    """The first model, with the force balances that were computed for it."""

    model: MechanicalModel
    """Fitted to the recordings; its tolerance says how far a diagnosis may re-tune it."""
    remarks: tuple[str, ...]
    """Sentences for the user on how the model was fitted, and what it does not show."""
    balances: "tuple[Balance, ...] | None" = None
    """Force balance of each command; None = not computed."""
