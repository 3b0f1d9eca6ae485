"""Builds the simulated omega.3 as a rig, with packed parameters, state at rest and compiled functions.

Its numbers are not those of the real device: see docs/simulated_omega3.md and `parameters`.
"""

import math
from dataclasses import replace

import numpy as np

from study.devices.device import DeviceInfo
from study.devices.rig import CompiledRig
from study.devices.simulated.compiled import advance, sense
from study.devices.simulated.layout import TICK_S
from study.devices.simulated.packing import compute_effective_mass_kg, make_rest_state, pack_parameters
from study.devices.simulated.parameters import Omega3Parameters, Vector

NAME = "simulated omega.3"
"""Name of the device in `DeviceInfo` and in recordings."""
MAX_FORCE_N = 12.0
"""Largest force of an omega.3 by its data sheet (N)."""


def build_omega3(
    seed: int,
    hand: bool,
    place_m: Vector = (0.0, 0.0, 0.0),
    friction: bool = True,
    parameters: Omega3Parameters | None = None,
) -> CompiledRig:
    """Build a device at rest at place_m (m), gravity compensated. seed: of the accelerometer's noise, any integer >= 0.
    hand: whether a simulated hand holds the handle. friction: False sets the Coulomb friction of the drives to zero, to
    show the effect of friction by comparison. parameters: those fitted to a calibration; None: the set of `parameters`.

    Raises ValueError where place_m is not closer to the origin than the end stop.
    """
    device_name = NAME if parameters is None else f"{NAME} as calibrated"
    parameter_source = "parameter set 1" if parameters is None else "linkage and masses of a calibration"
    parameters = parameters or Omega3Parameters()
    if not friction:
        parameters = replace(parameters, drives=replace(parameters.drives, friction_n_m=0.0))
    if not math.dist(place_m, (0.0, 0.0, 0.0)) < parameters.stops.radius_m:
        raise ValueError(f"place_m must be within {parameters.stops.radius_m} m of the centre, not {place_m}")
    packed_parameters = pack_parameters(parameters, hand, place_m)
    parameters_without_hand, parameters_with_hand = (
        pack_parameters(parameters, False, place_m),
        packed_parameters.copy(),
    )

    def simulate_hand(on_handle: bool) -> None:
        """Put the simulated hand on the handle or take it off; no effect in a device without a hand. Parameters that
        the hand does not change are kept, because a test may have altered them."""
        differs_with_hand = parameters_without_hand != parameters_with_hand
        packed_parameters[differs_with_hand] = (
            parameters_with_hand if on_handle and hand else parameters_without_hand
        )[differs_with_hand]

    details = f"{parameter_source}, {'with' if hand else 'without'} a hand, sensor noise from seed {seed}"
    mass_kg = compute_effective_mass_kg(parameters, packed_parameters)
    return CompiledRig(
        info=make_omega3_info(device_name if friction else f"{device_name} without friction", mass_kg, details),
        state=make_rest_state(packed_parameters, place_m),
        parameters=packed_parameters,
        noise=np.array(np.random.SeedSequence(seed).generate_state(1, np.uint64), dtype=np.uint64),
        sense=sense,
        advance=advance,
        simulate_hand=simulate_hand,
    )


def make_omega3_info(name: str, effective_mass_kg: float, details: str) -> DeviceInfo:
    """Make the `DeviceInfo` of a simulated omega.3: 1 kHz and `MAX_FORCE_N`, with the given mass (kg)."""
    return DeviceInfo(
        name=name,
        simulated=True,
        sample_rate_hz=1.0 / TICK_S,
        max_force_n=MAX_FORCE_N,
        effective_mass_kg=effective_mass_kg,
        details=details,
    )
