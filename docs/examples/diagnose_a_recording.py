# %% [markdown]
# # Which physics does a model lack?
#
# A cart on a spring with friction in its bearing: 20 s of a force and of the resulting position. No model is given, so
# a first one is fitted. The catalogue of effects is then searched for the remaining error.

# %%
import numpy as np

from analysis import diagnose
from equalizer import Recording, Signal

RATE_HZ, SECONDS = 1000.0, 20
MASS_KG, DAMPING, STIFFNESS, FRICTION_N = 0.5, 2.0, 200.0, 0.6

random = np.random.default_rng(1)
lines_hz = np.arange(0.5, 20.0, 0.5)
phases = random.uniform(0.0, 2 * np.pi, len(lines_hz))
time_s = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
force_n = 1.2 * np.sum(np.sin(2 * np.pi * lines_hz * time_s[:, None] + phases), axis=1)

# %% [markdown]
# Semi-implicit Euler steps of a tenth of a sample. The friction changes sign within 1 mm/s, so that the steps are
# stable.

# %%
position_m = np.zeros(len(time_s))
x, v, step_s = 0.0, 0.0, 0.1 / RATE_HZ
for number, force in enumerate(force_n):
    position_m[number] = x
    for _ in range(10):
        v += step_s * (force - DAMPING * v - STIFFNESS * x - FRICTION_N * np.tanh(v / 1e-3)) / MASS_KG
        x += step_s * v
position_m += random.normal(0.0, 2e-6, len(position_m))

# %%
recording = Recording(
    device="cart",
    command=Signal(force_n[:, None], RATE_HZ, "force", "N", ("fx",)),
    response=Signal(position_m[:, None], RATE_HZ, "position", "m", ("x",)),
)
found = diagnose(recording)
found

# %%
for remark in found.remarks:
    print(remark)
