"""Drivers by device name: builds the bare rig for `study.devices.opening`, which adds the safety layer.

Imports compiled code, which takes time: `opening` imports this module only when a device is opened.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from study.devices.device import CALIBRATED_PREFIX, REPLAY_PREFIX, DeviceSettings
from study.devices.force_dimension.device_models import MODELS
from study.devices.force_dimension.open_rig import open_force_dimension_rig
from study.devices.rig import CompiledRig, Rig
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.parameters import Omega3Parameters
from study.devices.simulated.simulated_linkage import fit_linkage
from study.errors import DeviceError
from study.store.formats.calibration_file import read_calibration


def make_simulated_rig(settings: DeviceSettings, seed: int) -> CompiledRig:
    """Make the simulated omega.3. Raises `DeviceError` where `settings.place_m` is outside the workspace."""
    return _build_simulated(settings, seed, friction=True)


def make_frictionless_rig(settings: DeviceSettings, seed: int) -> CompiledRig:
    """Make the simulated omega.3 without dry friction in its drives. Raises `DeviceError` where `settings.place_m` is
    outside the workspace."""
    return _build_simulated(settings, seed, friction=False)


def make_calibrated_rig(path: Path, settings: DeviceSettings, seed: int) -> CompiledRig:
    """Make the simulated device with the linkage and the inertia of the calibration file `path`. Raises `StudyError`
    for a file that cannot be used, `DeviceError` where no linkage of its kind fits and as `make_simulated_rig`."""
    calibration = read_calibration(path)
    try:
        fitted_linkage = fit_linkage(calibration)
    except ValueError as error:
        raise DeviceError(
            "The simulated device cannot be opened",
            f"It cannot imitate the calibrated {calibration.device}: {error}.",
            f"Use --device simulated, which needs no calibration; `hapteq validate {path}` says what the file "
            "contains.",
        ) from error
    return _build_simulated(settings, seed, friction=True, parameters=fitted_linkage.parameters)


def _build_simulated(
    settings: DeviceSettings, seed: int, friction: bool, parameters: Omega3Parameters | None = None
) -> CompiledRig:
    """Build the simulated device (`build_omega3`). Raises `DeviceError` for settings that it refuses."""
    try:
        return build_omega3(seed, settings.hand_on_handle, settings.place_m, friction, parameters)
    except ValueError as error:
        raise DeviceError(
            "The simulated device cannot be opened", f"It refused its settings: {error}.", "Choose another place."
        ) from error


def _make_real_rig(name: str, settings: DeviceSettings, seed: int) -> Rig:
    """Open the rig of a real device. `seed` is not used, because nothing in the driver is random."""
    return open_force_dimension_rig(name, settings)


RIGS_BY_NAME: dict[str, Callable[[DeviceSettings, int], Rig | CompiledRig]] = {
    "simulated": make_simulated_rig,
    "simulated-frictionless": make_frictionless_rig,
    **{name: partial(_make_real_rig, name) for name in MODELS},
}
"""Builder of a rig from settings and seed, by device name; the same names as in `study.devices.opening`."""


def build_rig(name: str, settings: DeviceSettings, seed: int) -> Rig | CompiledRig:
    """Build the rig of a name in `RIGS_BY_NAME`, of a replay (`REPLAY_PREFIX` and a path) or of a calibrated simulation
    (`CALIBRATED_PREFIX` and a path). Raises `StudyError` where it cannot be built, and KeyError for any other name."""
    if name.startswith(REPLAY_PREFIX):
        # Imported only here: the import loads compiled code, which other devices do not need.
        from study.devices.replay.replay_rig import make_replay_rig

        return make_replay_rig(Path(name.removeprefix(REPLAY_PREFIX)))
    if name.startswith(CALIBRATED_PREFIX):
        return make_calibrated_rig(Path(name.removeprefix(CALIBRATED_PREFIX)), settings, seed)
    return RIGS_BY_NAME[name](settings, seed)
