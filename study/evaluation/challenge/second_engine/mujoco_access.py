"""Access to MuJoCo, the optional second physics engine of the blind test, which is imported only when a case is drawn.

Its integrator, friction and contacts differ from those of hapteq's own simulation, so that cases from it show whether a
diagnosis depends on that simulation.
"""

from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING

from study.evaluation.challenge.case_settings import CaseSettings

if TYPE_CHECKING:
    from study.evaluation.challenge.draw_case import Case, ModelOrigin

MUJOCO_EFFECTS = (
    "coulomb_friction", "viscous_damping", "added_mass", "constant_force", "end_stop", "backlash", "extra_mode",
    "hand_impedance", "force_gain", "force_saturation", "amplifier_lag", "transport_delay", "sensor_lag", "sensor_gain",
)  # fmt: skip
"""Names of the effects that MuJoCo cases can conceal: those of `BUILDERS` and `SENSOR_EFFECTS` in `mujoco_case`, stated
here because that module cannot be imported without MuJoCo."""


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
    """Draw a blind-test case that MuJoCo simulates. The arguments are those of `challenge.draw_case.draw_case`. Raises
    ImportError where MuJoCo is not installed, and ValueError as `mujoco_case.draw_mujoco_case` does."""
    from study.evaluation.challenge.second_engine.mujoco_case import draw_mujoco_case

    return draw_mujoco_case(seed, effects, origin, strength, name, settings)
