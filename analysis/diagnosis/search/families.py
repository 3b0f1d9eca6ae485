"""Families of effects that describe the same physics in several forms: one of a family at an axis at a time."""

from analysis.diagnosis.errors.hypothesis import Claim

DRY_FRICTION = frozenset(
    {
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "presliding_hysteresis",
        "position_dependent_friction",
    }
)

FAMILIES: tuple[frozenset[str], ...] = (
    DRY_FRICTION,
    frozenset({"amplifier_lag", "transport_delay"}),
    frozenset({"clock_drift", "logger_offset"}),
    frozenset({"sensor_misalignment", "cross_axis_sensitivity"}),
    frozenset({"sensor_offset", "sensor_drift"}),
    frozenset({"added_mass", "hand_impedance", "body_on_actuator"}),
    frozenset({"backlash", "loose_joint"}),
)


def excludes(held: Claim, other: Claim) -> bool:
    """Whether `other` cannot be added beside a claim that is part of the explanation."""
    if not set(held.sites) & set(other.sites):
        return False
    names = {held.effect.name, other.effect.name}
    return len(names) == 1 or any(names <= family for family in FAMILIES)
