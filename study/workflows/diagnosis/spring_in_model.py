"""A virtual spring that held the handle while it was recorded, as a part of the model that is compared."""

from dataclasses import replace

from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel


def with_spring(model: MechanicalModel, spring_n_per_m: float) -> MechanicalModel:
    """Alike along every driven axis; a negative one is taken off again."""
    if spring_n_per_m == 0:
        return model
    axes = driven_axes(model)
    return replace(model, stiffness=model.stiffness + spring_n_per_m * axes @ axes.T)


def spring_words(spring_n_per_m: float) -> tuple[str, ...]:
    if spring_n_per_m == 0:
        return ()
    return (
        f"A virtual spring of {spring_n_per_m:.0f} N/m held the handle at its place. It was added to the model for the "
        "comparison, and is not in improved.toml.",
    )
