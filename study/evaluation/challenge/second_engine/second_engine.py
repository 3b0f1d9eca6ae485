"""Access to the second physics engine, MuJoCo, which is optional: its own integrator, friction and contacts."""

from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING

from study.evaluation.challenge.rig import Rig

if TYPE_CHECKING:
    from study.evaluation.challenge.draw_case import Case, Concealed

EFFECTS = (
    "coulomb_friction", "viscous_damping", "added_mass", "constant_force", "end_stop", "backlash", "extra_mode",
    "hand_impedance", "force_gain", "force_saturation", "amplifier_lag", "transport_delay", "sensor_lag", "sensor_gain",
)  # fmt: skip
"""Effects that the engine expresses in its own terms, and those of actuator and sensor."""


def is_installed() -> bool:
    """Whether MuJoCo is there; it comes with the extra `prove`."""
    return find_spec("mujoco") is not None


def draw_engine_case(
    seed: int, effects: Sequence[str], concealed: "Concealed", strength: Sequence[float], name: str, rig: Rig
) -> "Case":
    """Draw a case as `draw_case` does, moved by the second engine. Raises ImportError where it is not installed."""
    from study.evaluation.challenge.second_engine.mujoco_case import draw_mujoco_case

    return draw_mujoco_case(seed, effects, concealed, strength, name, rig)
