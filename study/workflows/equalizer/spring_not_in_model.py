"""Virtual spring whose force must be compensated during playback, because the model does not contain it.

A model from the excitation to the response (`input` of its provenance is "excitation") contains the spring under which
it was recorded; a model from the total force does not.
"""

import math

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from study.errors import StudyError

SAME = 0.01
"""Relative difference of stiffness and of damping up to which two springs count as equal."""


def spring_outside_model(model: IdentifiedModel, spring: VirtualSpring) -> VirtualSpring:
    """The spring to compensate: `spring`, which acts during playback, or `NO_SPRING` if the model contains it. Raises
    StudyError if the model contains another spring."""
    if model.provenance.get("input") != "excitation":
        return spring
    feedback = model.provenance.get("feedback")
    held = feedback if isinstance(feedback, dict) else {}
    inside = VirtualSpring(float(held.get("stiffness_n_per_m", 0.0)), float(held.get("damping_n_s_per_m", 0.0)))
    if not (
        math.isclose(inside.stiffness_n_per_m, spring.stiffness_n_per_m, rel_tol=SAME)
        and math.isclose(inside.damping_n_s_per_m, spring.damping_n_s_per_m, rel_tol=SAME)
    ):
        raise StudyError(
            "This model was made under another spring",
            f"It holds a spring of {inside.stiffness_n_per_m:.4g} N/m and {inside.damping_n_s_per_m:.3g} N s/m, but "
            f"one of {spring.stiffness_n_per_m:.4g} N/m and {spring.damping_n_s_per_m:.3g} N s/m will act.",
            "Record and identify under the same spring, or identify without --with-spring.",
            saved="Nothing moved.",
        )
    return NO_SPRING
