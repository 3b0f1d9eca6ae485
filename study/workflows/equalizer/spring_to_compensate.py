"""Virtual spring whose force must be compensated during playback, because the identified model does not contain it.

A model from the excitation to the response (its provenance has `input` = "excitation") contains the virtual spring that
held the handle while it was recorded; a model from the total force (excitation plus spring) does not.
"""

import math
from typing import Any

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from study.errors import StudyError

SPRING_TOLERANCE = 0.01
"""Relative difference of stiffness and of damping up to which two springs count as equal. Chosen: allows for the
rounding of stored numbers."""


SPRING_PARAMETERS = ("stiffness_n_per_m", "damping_n_s_per_m", "natural_frequency_hz")
"""Names of the parameters of a virtual spring, in the metadata of recordings and models."""


def read_spring(feedback: object) -> dict[str, Any]:
    """Read the virtual spring from `feedback` of a recording's metadata or of a model's provenance:
    `SPRING_PARAMETERS`, and other entries as they are; empty where it states none. Raises StudyError for a parameter
    that is no number."""
    spring = feedback if isinstance(feedback, dict) else {}
    for name in SPRING_PARAMETERS:
        value = spring.get(name, 0.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise StudyError(
                "The virtual spring of a recording cannot be read",
                f"Its metadata, or those of the model made from it, state {value!r} as {name} of `feedback`.",
                "Give a number there, in the unit of the name, and identify the model again.",
                saved="Nothing was written, and nothing moved.",
            )
    return spring


def find_spring_to_compensate(model: IdentifiedModel, spring: VirtualSpring) -> VirtualSpring:
    """Find the spring to compensate: `spring`, which acts during playback, or `NO_SPRING` if the model contains it.
    Raises StudyError if the model contains a spring of another stiffness or damping, and as `read_spring`."""
    if model.provenance.get("input") != "excitation":
        return spring
    model_feedback = read_spring(model.provenance.get("feedback"))
    model_spring = VirtualSpring(
        float(model_feedback.get("stiffness_n_per_m", 0.0)), float(model_feedback.get("damping_n_s_per_m", 0.0))
    )
    if not (
        math.isclose(model_spring.stiffness_n_per_m, spring.stiffness_n_per_m, rel_tol=SPRING_TOLERANCE)
        and math.isclose(model_spring.damping_n_s_per_m, spring.damping_n_s_per_m, rel_tol=SPRING_TOLERANCE)
    ):
        raise StudyError(
            "This model was made under another spring",
            f"It holds a spring of {model_spring.stiffness_n_per_m:.4g} N/m and {model_spring.damping_n_s_per_m:.3g} "
            f"N s/m, but one of {spring.stiffness_n_per_m:.4g} N/m and {spring.damping_n_s_per_m:.3g} N s/m will act.",
            "Record and identify under the same spring, or identify without --with-spring.",
            saved="Nothing moved.",
        )
    return NO_SPRING
