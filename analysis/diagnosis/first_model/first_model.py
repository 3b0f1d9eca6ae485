"""Result of fitting a starting model for a diagnosis, where the user gave none."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from equalizer.plant.mechanical_model import MechanicalModel

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


@dataclass(frozen=True, slots=True, eq=False)
class FirstModel:
    """A mechanical model fitted to recordings, with the force balances that were computed for it."""

    model: MechanicalModel
    """Fitted to the diagnosed recordings, or to clean ones where there are any; its tolerances limit how far a
    diagnosis re-tunes it."""
    remarks: tuple[str, ...]
    """Sentences for the user: how the model was fitted, and its limits."""
    balances: "tuple[Balance, ...] | None" = None
    """Force balances of the same recordings; None = not computed."""
