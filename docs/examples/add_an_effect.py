# %% [markdown]
# # Add an effect of your own
#
# A law outside the catalogue is a formula of the motion. Here it is a force that grows with the 1.5th power of the
# speed. A diagnosis tests it together with the catalogue, at every axis.

# %%
import numpy as np

from analysis import DiagnosisSettings, diagnose
from equalizer import MechanicalModel, Recording, Signal
from equalizer.effects.law_entry import LawEntry
from equalizer.laws.law import Law

entry = LawEntry(
    name="power_drag",
    law=Law(
        expression="-p0*abs(vx)**p1*sign(vx)",
        numbers=(3.0, 1.4),
        units=("N (m/s)^-1.5", "1"),
        acts_on="force",
        axis="x",
    ),
    source="our own measurement",
    signature="it grows with a power of the speed between one and two",
)

# %%
RATE_HZ = 1000.0
random = np.random.default_rng(2)
time_s = np.arange(12_000) / RATE_HZ
lines_hz = np.arange(0.5, 15.0, 0.5)
phases = random.uniform(0.0, 2 * np.pi, len(lines_hz))
force_n = np.sum(np.sin(2 * np.pi * lines_hz * time_s[:, None] + phases), axis=1)
position_m = np.zeros(len(time_s))
x = v = 0.0
for number, force in enumerate(force_n):
    position_m[number] = x
    for _ in range(10):
        v += 0.1 / RATE_HZ * (force - 1.0 * v - 100.0 * x - 4.1 * abs(v) ** 1.5 * np.sign(v)) / 0.4
        x += 0.1 / RATE_HZ * v
position_m += random.normal(0.0, 1e-6, len(position_m))
recording = Recording(
    "sledge",
    Signal(force_n[:, None], RATE_HZ, "force", "N", ("fx",)),
    Signal(position_m[:, None], RATE_HZ, "position", "m", ("x",)),
)

# %%
model = MechanicalModel(
    name="sledge",
    quantity="position",
    mass=np.array([[0.4]]),
    damping=np.array([[1.0]]),
    stiffness=np.array([[100.0]]),
    input=np.array([[1.0]]),
    output=np.array([[1.0]]),
)
found = diagnose(recording, model, DiagnosisSettings(kept=(entry,)))
found
