"""The one door: what it opens, what it refuses, and that there is no other."""

import math
import subprocess
import sys
from dataclasses import asdict, fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from protocols.definition.plausibility import PlausibilitySettings
from study.devices import opening
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import DeviceInfo, DeviceSettings
from study.devices.opening import DEVICES, FRICTIONLESS, REAL_DEVICES, SIMULATIONS, open_device
from study.devices.rig import READING_SIZE
from study.devices.rigs_by_name import RIGS_BY_NAME
from study.devices.safe import SafeDevice
from study.errors import DeviceError, ExitCode
from study.session.stimulus.limits import Limits

ROOT = Path(__file__).parents[3]
LIMITS = Limits(
    stimulus_cap_n=3.0, total_cap_n=4.5, slew_n_per_s=1500.0, longest_hold_s=20.0, watchdog_s=0.3, release_s=0.05
)
SETTINGS = DeviceSettings(
    limits=LIMITS, spring_frequency_hz=3.5, spring_damping_n_s_per_m=0.0, keep_s=0.5, hand_on_handle=True
)


def limited(**changes: float) -> DeviceSettings:
    return replace(SETTINGS, limits=replace(LIMITS, **changes))


def test_the_simulated_device_opens_and_says_that_it_is_simulated():
    device = open_device("simulated", SETTINGS, VirtualClock(), seed=1)
    assert device.info.simulated
    device.close()


@pytest.mark.parametrize("name", ["omega33", "replay", ""])
def test_another_name_is_refused_with_the_names_that_work(name):
    with pytest.raises(DeviceError, match=r"Known are simulated, omega3, .*--device simulated") as refusal:
        open_device(name, SETTINGS, VirtualClock(), seed=1)
    assert refusal.value.exit_code is ExitCode.DEVICE


@pytest.mark.parametrize("name", ["stimulus_cap_n", "total_cap_n", "slew_n_per_s", "watchdog_s", "release_s"])
@pytest.mark.parametrize("value", [math.nan, -1.0, 0.0, math.inf])
def test_a_limit_that_is_not_positive_and_finite_is_refused(name, value):
    with pytest.raises(DeviceError, match=f"limits are not safe.*{name} is .*at most"):
        open_device("simulated", limited(**{name: value}), VirtualClock(), seed=1)


BOUNDS = [field.name for field in fields(PlausibilitySettings)]


@pytest.mark.parametrize("name", ["feedback_cap_n", *BOUNDS])
@pytest.mark.parametrize("value", [math.nan, -1.0, math.inf])
def test_a_position_bound_that_is_negative_or_not_finite_is_refused(name, value):
    bounds = None if name == "feedback_cap_n" else unchecked_bounds(name, value)
    settings = limited(feedback_cap_n=value) if bounds is None else limited(plausibility=bounds)
    with pytest.raises(DeviceError, match=f"limits are not safe.*{name} is .*at most"):
        open_device("simulated", settings, VirtualClock(), seed=1)


def unchecked_bounds(name: str, value: float) -> SimpleNamespace:
    """A protocol would refuse the value before: here it comes past that."""
    return SimpleNamespace(**(asdict(PlausibilitySettings()) | {name: value}))


@pytest.mark.parametrize("name", ["sample_rate_hz", "effective_mass_kg"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 0.0, 1e6])
def test_a_device_with_impossible_properties_is_refused(rigs, name, value):
    """The spring's stiffness is made from its mass, every duration from its rate."""
    rig = replace(rigs.compiled_rig(), info=replace(rigs.INFO, **{name: value}))
    with pytest.raises(DeviceError, match=f"it reports implausible properties.*{name} is"):
        SafeDevice(rig, rigs.SETTINGS, VirtualClock())


@pytest.mark.parametrize(
    "settings",
    [
        limited(feedback_cap_n=6.1),
        limited(total_cap_n=6.1),
        limited(stimulus_cap_n=3.1, total_cap_n=6.0),
        limited(stimulus_cap_n=3.0, total_cap_n=2.0),
        limited(longest_hold_s=1e4),
        replace(SETTINGS, spring_frequency_hz=50.0),
        replace(SETTINGS, spring_damping_n_s_per_m=-1.0),
        replace(SETTINGS, keep_s=0.0),
        replace(SETTINGS, place_m=(0.0, math.nan, 0.0)),
    ],
)
def test_with_a_hand_on_the_handle_nothing_goes_beyond_the_ceiling(settings):
    with pytest.raises(DeviceError):
        open_device("simulated", settings, VirtualClock(), seed=1)


def test_a_place_that_is_not_finite_is_refused_by_name():
    with pytest.raises(DeviceError, match="place"):
        open_device("simulated", replace(SETTINGS, place_m=(0.0, math.nan, 0.0)), VirtualClock(), seed=1)


@pytest.mark.parametrize("place_m", [(20.0, 0.0, 0.0), (0.1, 0.1, 0.0), (math.inf, 0.0, 0.0), (0.0, math.nan, 0.0)])
def test_a_place_outside_the_workspace_as_in_millimetres_is_refused_by_every_device(rigs, place_m):
    """Its spring would hold the handle at the end of its travel."""
    with pytest.raises(DeviceError, match=r"place_m is .*within 0\.12 m of the origin.*in metres"):
        SafeDevice(rigs.ScriptedRig(), replace(rigs.SETTINGS, place_m=place_m), VirtualClock())


def test_a_slew_rate_that_is_refused_names_what_it_follows_from():
    with pytest.raises(DeviceError, match=r"slew_n_per_s is 200000; .*shortest fade"):
        open_device("simulated", limited(slew_n_per_s=2e5), VirtualClock(), seed=1)


STRONG = replace(limited(stimulus_cap_n=8.0, total_cap_n=12.0), hand_on_handle=False)


def test_without_a_hand_the_ceiling_can_be_raised_to_the_device_limit():
    open_device("simulated", replace(STRONG, beyond_hand_ceiling=True), VirtualClock(), 1).close()
    stronger = replace(limited(total_cap_n=12.5), hand_on_handle=False, beyond_hand_ceiling=True)
    with pytest.raises(DeviceError, match=r"total_cap_n is 12\.5; it must be above 0 and at most 12"):
        open_device("simulated", stronger, VirtualClock(), 1)


def test_that_no_hand_is_on_the_handle_does_not_raise_the_ceiling_by_itself():
    with pytest.raises(DeviceError, match=r"total_cap_n is 12; it must be above 0 and at most 6"):
        open_device("simulated", STRONG, VirtualClock(), 1)
    with pytest.raises(DeviceError, match=r"stimulus_cap_n is 8; it must be above 0 and at most 3"):
        open_device("simulated", replace(STRONG, limits=replace(STRONG.limits, total_cap_n=6.0)), VirtualClock(), 1)


def test_a_higher_ceiling_with_a_hand_is_refused():
    settings = replace(SETTINGS, beyond_hand_ceiling=True)
    with pytest.raises(DeviceError, match="beyond_hand_ceiling is set while a hand is on the handle"):
        open_device("simulated", settings, VirtualClock(), 1)


def test_every_device_that_is_offered_can_be_built():
    assert set(DEVICES) <= {*SIMULATIONS, *REAL_DEVICES} == set(RIGS_BY_NAME)


def test_the_device_without_friction_says_so_and_is_offered_nowhere():
    device = open_device(FRICTIONLESS, SETTINGS, VirtualClock(), seed=1)
    assert (device.info.simulated, device.info.name) == (True, "simulated omega.3 without friction")
    assert FRICTIONLESS not in DEVICES
    device.close()


def test_importing_the_opening_loads_no_driver():
    code = "import sys, study.devices.opening; print(sorted({'numba', 'scipy'} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


class OwnRig:
    """A driver of a lab's own, over no library at all."""

    def __init__(self, says_simulated: bool) -> None:
        self.closed = False
        self.drops_force_after_s = 0.03
        self.info = DeviceInfo("own", says_simulated, 1000.0, 10.0, 0.3, details="serial 1")

    def sense(self) -> np.ndarray:
        return np.zeros(READING_SIZE)

    def buttons(self) -> frozenset[int]:
        return frozenset()

    def write(self, force_n: np.ndarray) -> None:
        """It takes every force."""

    def close(self) -> None:
        self.closed = True


@pytest.fixture(params=[False, True], ids=["says that it is real", "says that it is simulated"])
def own(request, monkeypatch, tmp_path):
    """As docs/own_device.md says to put it in."""
    rig = OwnRig(request.param)
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    monkeypatch.setitem(RIGS_BY_NAME, "own", lambda settings, seed: rig)
    monkeypatch.setattr(opening, "REAL_DEVICES", (*REAL_DEVICES, "own"))
    return rig


def test_a_driver_of_a_lab_s_own_opens_for_no_hand_without_an_acceptance(own, vendor):
    with pytest.raises(DeviceError, match="own is locked for hands.*no acceptance of it"):
        open_device("own", SETTINGS, RealClock(), seed=1, own_process=False)
    assert own.closed
    vendor.accept("own", details="serial 2")
    with pytest.raises(DeviceError, match=r"Another was accepted \(own, serial 2\); this is own, serial 1"):
        open_device("own", SETTINGS, RealClock(), seed=1, own_process=False)
    vendor.accept("own", details="serial 1", on="2020-01-01")
    with pytest.raises(DeviceError, match="holds for 180 days"):
        open_device("own", SETTINGS, RealClock(), seed=1, own_process=False)
    vendor.accept("own", details="serial 1")
    open_device("own", SETTINGS, RealClock(), seed=1, own_process=False).close()


def test_without_a_hand_a_driver_of_a_lab_s_own_opens(own):
    settings = replace(SETTINGS, hand_on_handle=False)
    open_device("own", settings, RealClock(), seed=1, own_process=False).close()


def test_a_driver_that_cannot_show_its_force_is_not_accepted(own):
    with pytest.raises(
        DeviceError, match="its driver has no read_reported_n, read_reported_without_cap_n, withhold, is_force_on"
    ):
        opening.accept_device("own", SETTINGS, RealClock(), "Ada")
    assert own.closed
    with pytest.raises(DeviceError, match="locked for hands"):
        open_device("own", SETTINGS, RealClock(), seed=1, own_process=False)


def test_what_a_single_vendor_s_driver_offers_is_refused_for_a_driver_of_a_lab_s_own(own):
    assert opening.examine_device("own") == ()
    with pytest.raises(DeviceError, match="'own' is no device of Force Dimension"):
        opening.calibrate_device("own", 1.0)
    with pytest.raises(DeviceError, match="'own' is of another vendor"), opening.open_linkage("own"):
        pass


@pytest.mark.parametrize("name", [name for name in RIGS_BY_NAME if name not in SIMULATIONS])
def test_no_device_that_is_not_simulated_opens_for_a_hand_without_an_acceptance(name, monkeypatch, tmp_path):
    """Behind each name stands a driver that checks nothing itself."""
    rig = OwnRig(says_simulated=False)
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    monkeypatch.setitem(RIGS_BY_NAME, name, lambda settings, seed: rig)
    with pytest.raises(DeviceError, match="locked for hands"):
        open_device(name, SETTINGS, RealClock(), seed=1, own_process=False)
    assert rig.closed
