"""Access to the second physics engine, MuJoCo, which is optional and imported only when a case is drawn.

With another integrator, other friction and other contacts, it shows whether a diagnosis depends on hapteq's own
simulation.
"""

from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING

from study.evaluation.challenge.case_settings import CaseSettings

if TYPE_CHECKING:
    from study.evaluation.challenge.draw_case import Case, ModelOrigin

EFFECTS = (
    "coulomb_friction", "viscous_damping", "added_mass", "constant_force", "end_stop", "backlash", "extra_mode",
    "hand_impedance", "force_gain", "force_saturation", "amplifier_lag", "transport_delay", "sensor_lag", "sensor_gain",
)  # fmt: skip
"""Names of the effects that can be concealed with this engine."""


def is_installed() -> bool:
    """Whether MuJoCo is installed; the optional dependencies `hapteq[prove]` contain it."""
    return find_spec("mujoco") is not None


def draw_engine_case(
    seed: int,
    effects: Sequence[str],
    origin: "ModelOrigin",
    strength: Sequence[float],
    name: str,
    settings: CaseSettings,
) -> "Case":
    """Draw a case as `draw_case` does, simulated by MuJoCo. Raises ImportError where it is not installed."""
    from study.evaluation.challenge.second_engine.mujoco_case import draw_mujoco_case

    return draw_mujoco_case(seed, effects, origin, strength, name, settings)
