"""Result of fitting a starting model for a diagnosis, where the user gave none."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel

REPLACED_REMARK = (
    "No model was given. The linear model that was fitted first was replaced by that of the force balance: one body "
    "per axis, with damping and a spring. Its parameters may change by a tenth, and by half of what the named laws "
    "change in them."
)
"""Remark of a diagnosis that replaced its first model (`confirm.force_balance_measures`)."""

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

    def list_remarks(self, initial_model: MechanicalModel, measure_name: str) -> tuple[str, ...]:
        """List the remarks for a diagnosis with this initial model and error measure: those on the first model, if any,
        or `REPLACED_REMARK` where forces were compared with a model of other masses or dampers (a session's virtual
        spring may have been added). Other measures keep the first model."""
        is_kept = all(
            np.array_equal(getattr(self.model, name), getattr(initial_model, name)) for name in ("mass", "damping")
        )
        return self.remarks if is_kept or not self.remarks or measure_name != "predicted force" else (REPLACED_REMARK,)
