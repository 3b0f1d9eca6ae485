# %% [markdown]
# # Drive a device of your own
#
# A driver maps a vendor's calls to the methods of `Rig`: info, sense, buttons, write, close, and the time of the
# device's own watchdog. The layer above it protects the person (`SafeDevice`). The vendor's library is invented here:
# it uses millimetres and millinewtons, measures acceleration in thousandths of g, and drops its force 50 ms after the
# last call.

# %%
import numpy as np

from equalizer.signals.signal import Signal
from study.devices.clock import VirtualClock
from study.devices.device import DeviceInfo, DeviceSettings
from study.devices.rig import ACCELERATION, POSITION, READING_SIZE, TRUE_ACCELERATION
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from study.session.stimulus.limits import Limits


class InventedLibrary:
    """A handle of 0.3 kg on an oil damper. Each read advances time by a millisecond."""

    def __init__(self) -> None:
        self.opened = True
        self.force_mn = np.zeros(3)
        self._x_mm, self._v_mm_s = np.zeros(3), np.zeros(3)

    def read(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Position in mm and acceleration in thousandths of g; None where the device does not answer."""
        if not self.opened:
            return None
        a_mm_s2 = (self.force_mn - 2.0 * self._v_mm_s) / 0.3
        self._v_mm_s = self._v_mm_s + 1e-3 * a_mm_s2
        self._x_mm = self._x_mm + 1e-3 * self._v_mm_s
        return np.round(self._x_mm, 3), np.round(a_mm_s2 / 9.80665)

    def send_mn(self, force_mn: np.ndarray) -> None:
        self.force_mn = force_mn if self.opened else np.zeros(3)

    def shut(self) -> None:
        self.opened, self.force_mn = False, np.zeros(3)


# %% [markdown]
# ## The driver
#
# SI units, the handle's place in the axes of the protocol (x toward the operator, y to the right, z up). Unknown values
# are NaN, never zero: a zero would be taken for a measurement.


# %%
class InventedRig:
    """The `Rig` of `study.devices.rig` over that library."""

    def __init__(self, library: InventedLibrary) -> None:
        self._library = library

    @property
    def info(self) -> DeviceInfo:
        return DeviceInfo(
            name="invented",
            simulated=False,
            sample_rate_hz=1000.0,
            max_force_n=8.0,
            effective_mass_kg=0.3,
            details="serial 0001",
        )

    @property
    def drops_force_after_s(self) -> float:
        """As set in the device. Nothing else ends a force when the computer hangs."""
        return 0.05

    def sense(self) -> np.ndarray:
        answer = self._library.read()
        if answer is None:
            raise DeviceError(
                "The device does not answer", "The library gave no position.", "Check its cable and its power."
            )
        position_mm, thousandths_of_g = answer
        reading = np.zeros(READING_SIZE)
        reading[POSITION] = 1e-3 * position_mm
        reading[ACCELERATION] = 9.80665e-3 * thousandths_of_g
        reading[TRUE_ACCELERATION] = np.nan
        return reading

    def buttons(self) -> frozenset[int]:
        return frozenset()

    def write(self, force_n: np.ndarray) -> None:
        self._library.send_mn(1e3 * np.asarray(force_n))

    def close(self) -> None:
        """Force off first; may be called again, and from another thread while a call hangs."""
        self._library.send_mn(np.zeros(3))
        self._library.shut()


# %% [markdown]
# ## Behind the safety layer
#
# In the program `open_device` does this. A stimulus above its cap is refused before anything moves. No request gives
# the driver a force above the caps.

# %%
LIMITS = Limits(
    stimulus_cap_n=3.0, total_cap_n=4.5, slew_n_per_s=1500.0, longest_hold_s=20.0, watchdog_s=0.3, release_s=0.05
)
settings = DeviceSettings(
    limits=LIMITS, spring_frequency_hz=3.5, spring_damping_n_s_per_m=0.5, keep_s=0.5, hand_on_handle=True
)
time_s = np.arange(1000) / 1000.0


def sine_n(amplitude_n: float) -> Signal:
    force_n = np.zeros((len(time_s), 3))
    force_n[:, 0] = amplitude_n * np.sin(2 * np.pi * 25.0 * time_s)
    return Signal(force_n, 1000.0, "force", "N", ("fx", "fy", "fz"))


library = InventedLibrary()
device = SafeDevice(InventedRig(library), settings, VirtualClock())
played = device.play(sine_n(1.0))
moved_mm = 1e3 * np.ptp(played.recording.position.samples[:, 0])
try:
    device.play(sine_n(4.0))
except DeviceError as refused:
    refusal = refused.happened
device.close()
print(f"{moved_mm:.2f} mm at 1 N. At 4 N: {refusal}")
