"""Drivers by name: builds the bare device for `study.devices.opening`, which alone may ask for one. Heavy to import:
loaded when a device is opened."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from study.devices.device import CALIBRATED, REPLAY, DeviceSettings
from study.devices.force_dimension.models import MODELS
from study.devices.force_dimension.rigs import force_dimension_rig
from study.devices.rig import CompiledRig, Rig
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.own_linkage import fit_linkage
from study.devices.simulated.parameters import Omega3Parameters
from study.errors import DeviceError
from study.store.formats.calibration_file import read_calibration


def make_simulated_rig(settings: DeviceSettings, seed: int) -> CompiledRig:
    """The simulated omega.3. Raises `DeviceError` for a place where there is no workspace."""
    return _build_simulated(settings, seed, friction=True)


def frictionless_rig(settings: DeviceSettings, seed: int) -> CompiledRig:
    """The simulated omega.3 without friction. Raises as `make_simulated_rig`."""
    return _build_simulated(settings, seed, friction=False)


def make_calibrated_rig(path: Path, settings: DeviceSettings, seed: int) -> CompiledRig:
    """The simulated device with the linkage and the inertia of a calibration. Raises `StudyError` for a file that
    cannot be used."""
    calibration = read_calibration(path)
    try:
        fitted = fit_linkage(calibration)
    except ValueError as error:
        raise DeviceError(
            "The simulated device cannot be opened",
            f"It cannot stand in for the calibrated {calibration.device}: {error}.",
            f"Use --device simulated, whose linkage is its own; `hapteq validate {path}` says what the file holds.",
        ) from error
    return _build_simulated(settings, seed, friction=True, parameters=fitted.parameters)


def _build_simulated(
    settings: DeviceSettings, seed: int, friction: bool, parameters: Omega3Parameters | None = None
) -> CompiledRig:
    try:
        return build_omega3(seed, settings.hand_on_handle, settings.place_m, friction, parameters)
    except ValueError as error:
        raise DeviceError(
            "The simulated device cannot be opened", f"It refused its settings: {error}.", "Choose another place."
        ) from error


def _real_rig(name: str, settings: DeviceSettings, seed: int) -> Rig:
    """The rig of a real device. The seed is not used: nothing in it is random."""
    return force_dimension_rig(name, settings)


RIGS_BY_NAME: dict[str, Callable[[DeviceSettings, int], Rig | CompiledRig]] = {
    "simulated": make_simulated_rig,
    "simulated-frictionless": frictionless_rig,
    **{name: partial(_real_rig, name) for name in MODELS},
}
"""Rig of a name, its settings and a seed; the same names as in `study.devices.opening`."""


def find_rig(name: str, settings: DeviceSettings, seed: int) -> Rig | CompiledRig:
    """The rig of a known name, a replay, or a simulation as calibrated. Raises `StudyError`."""
    if name.startswith(REPLAY):
        # Imported here: its compiled code is loaded then.
        from study.devices.replay.replay_rig import replay_rig

        return replay_rig(Path(name.removeprefix(REPLAY)))
    if name.startswith(CALIBRATED):
        return make_calibrated_rig(Path(name.removeprefix(CALIBRATED)), settings, seed)
    return RIGS_BY_NAME[name](settings, seed)
