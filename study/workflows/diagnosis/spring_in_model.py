"""A virtual spring that held the handle during recording, added to the model."""

from dataclasses import replace

from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel


def with_spring(model: MechanicalModel, spring_n_per_m: float) -> MechanicalModel:
    """The model with this stiffness added along every driven axis; a negative one is subtracted."""
    if spring_n_per_m == 0:
        return model
    axes = driven_axes(model)
    return replace(model, stiffness=model.stiffness + spring_n_per_m * axes @ axes.T)


def spring_words(spring_n_per_m: float) -> tuple[str, ...]:
    """Remark about the spring; empty if there is none."""
    if spring_n_per_m == 0:
        return ()
    return (
        f"A virtual spring of {spring_n_per_m:.0f} N/m held the handle at its place. It was added to the model for the "
        "comparison, and is not in improved.toml.",
    )
