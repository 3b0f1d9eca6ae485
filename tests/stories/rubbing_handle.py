"""A device that rubs along y, its recordings, and the model that a laboratory has of it without the friction."""

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from equalizer.identification.mechanical.modal_structure import transform_to_driven_axes
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, Tolerance
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.feedforward.trajectory import Trajectory
from equalizer.tracking.learning.iteration import rms
from study.cli.main import main
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.store.formats.trajectory_file import read_trajectory, write_trajectory

RATE_HZ, BAND_HZ, MODES = 1000.0, (5.0, 35.0), 8
FRICTION_N = (0.0, 0.15, 0.0)
LEVELS_N = (0.5, 1.0, 2.0)
LONG, SHORT = 5000, 2000
"""Periods for a linear model and for a diagnosis, samples."""
FORCES, ACCELERATIONS = ("fx", "fy", "fz"), ("ax", "ay", "az")


@dataclass(frozen=True)
class RubbingHandle:
    plants: ModuleType
    rubbing: ModuleType
    folder: Path
    seed: int

    def prepare(self) -> None:
        """Recordings to identify and to diagnose by, a nominal model, and what is wanted."""
        for third in range(3):
            write_recording(self.folder / f"identify_{third}.h5", self._recorded(third, 1.0, LONG, 2))
            write_recording(self.folder / f"diagnose_{third}.h5", self._recorded(third, LEVELS_N[third], SHORT, 3))
        write_mechanical_model(self.folder / "nominal.toml", nominal(self.plants.modes_of()[:MODES]))
        wanted = Signal(_wanted(self.seed), RATE_HZ, "acceleration", "m/s^2", ACCELERATIONS)
        write_trajectory(self.folder / "wanted.csv", Trajectory(wanted))

    def diagnose(self, without: tuple[str, ...], *options: str) -> Path:
        """The folder of the diagnosis, from the command line."""
        sources = [str(self.folder / f"diagnose_{third}.h5") for third in range(3)]
        left_out = [part for name in without for part in ("--without", name)]
        out, model = self.folder / "found", self.folder / "nominal.toml"
        assert main(["diagnose", *sources, "--model", str(model), "--out", str(out), *left_out, *options]) == 0
        return out

    def first_play(self, name: str, *options: str) -> tuple[FloatArray, float]:
        """(4,), errors of the handle's true motion within the band, of all and per axis, over what is wanted; and the
        largest force, N. options: of identify and equalize alike."""
        model, forces, wanted = (self.folder / part for part in (f"{name}.h5", f"{name}.csv", "wanted.csv"))
        recordings = [str(self.folder / f"identify_{third}.h5") for third in range(3)]
        assert main(["identify", *recordings, "--out", str(model), *options]) == 0
        assert main(["equalize", str(model), str(wanted), "--out", str(forces), *options]) == 0
        meant, played = (read_trajectory(path).signal.samples for path in (wanted, forces))
        left = filter_to_band(self._device().play(played) - meant, RATE_HZ, BAND_HZ)
        errors = [rms(left) / rms(meant), *(rms(left[:, axis]) / rms(meant[:, axis]) for axis in range(3))]
        return np.array(errors), float(np.linalg.norm(played, axis=1).max())

    def _device(self):
        return self.rubbing.rubbing(self.plants.modes_of()[:MODES], FRICTION_N)

    def _recorded(self, third: int, level: float, period: int, looks: int) -> Recording:
        """Multisines on all axes at once, phases turned by so many thirds."""
        lines = np.fft.rfft(self.plants.multisine(4.5, 37, period / RATE_HZ, level, seed=self.seed), axis=0)
        turned = np.fft.irfft(lines * np.exp(2j * np.pi / 3 * third * np.arange(3)), period, axis=0)
        played = np.tile(turned, (looks, 1))
        read = self._device().measured(played, 10 * self.seed + third)
        force = Signal(played, RATE_HZ, "force", "N", FORCES)
        return Recording(
            "rubbing",
            force,
            Signal(read, RATE_HZ, "acceleration", "m/s^2", ACCELERATIONS),
            excitation=force,
            segments=(Segment(0, looks * period, "multisine", level, period),),
            meta={"place_m": [0, 0, 0]},
        )


def nominal(modes) -> MechanicalModel:
    """Frequencies, damping and shapes a little off; one pole and a delay for those of motor, sensor and hold."""
    off = [(f * 1.002, zeta * 1.02, shape * 0.995) for f, zeta, shape in modes]
    shapes = np.array([shape for _, _, shape in off])
    speed = 2 * np.pi * np.array([f for f, _, _ in off])
    damping = np.diag([2 * zeta * w for (_, zeta, _), w in zip(off, speed, strict=True)])
    modal = MechanicalModel(
        "without friction", "acceleration", np.eye(len(off)), damping, np.diag(speed**2), shapes, shapes.T,
        actuator=ActuatorLimits(delay_s=0.00109, bandwidth_hz=320.0), tolerance=Tolerance(0.006, 0.5, 4.0, 0.005),
    )  # fmt: skip
    return transform_to_driven_axes(modal)


def _wanted(seed: int) -> FloatArray:
    """Two seconds of noise in the band, 1.8 m/s² rms per axis, and rest around it."""
    noise = filter_to_band(np.random.default_rng(seed).standard_normal((6000, 3)), RATE_HZ, BAND_HZ)[2000:4000]
    fade = np.clip(np.minimum(np.arange(2000), np.arange(2000)[::-1]) / 100, 0, 1)[:, None]
    rows = np.zeros((2600, 3))
    rows[300:-300] = 1.8 * noise / noise.std(axis=0) * (0.5 - 0.5 * np.cos(np.pi * fade))
    return np.asarray(filter_to_band(rows, RATE_HZ, BAND_HZ))
