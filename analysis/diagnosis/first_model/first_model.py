"""The model that a diagnosis starts from."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from equalizer.plant.mechanical_model import MechanicalModel

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


@dataclass(frozen=True, slots=True, eq=False)
class FirstModel:
    """Force balances and first model that a diagnosis starts from where no model was given."""

    model: MechanicalModel
    remarks: tuple[str, ...]
    """Remarks about it."""
    balances: "tuple[Balance, ...] | None" = None
    """Force balances; None = not computed."""
