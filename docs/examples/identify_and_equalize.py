# %% [markdown]
# # Identify a device, and compute the forces for a wanted acceleration
#
# The steps: a short recording of the simulated device, a state-space model of it, and the forces.

# %%
import tempfile
from pathlib import Path

import numpy as np

from equalizer import IdentificationSettings, Signal, equalize, identify
from protocols import load_protocol
from study import RecordingPlan, read_protocol, read_recording, record_device

# The shipped protocol takes five minutes; periods of ten seconds are enough for an example.
text = read_protocol("sweep_band").text.replace("duration_s = 30.0", "duration_s = 10.0")
protocol = load_protocol(text.replace('name = "sweep_band"', 'name = "short_sweeps"'), "short_sweeps.toml")

# %%
out = Path(tempfile.mkdtemp(prefix="hapteq-example-")) / "sweeps.h5"
plan = RecordingPlan(protocol, device="simulated", place_m=(0.0, 0.0, 0.0), seed=1, out=out)
record_device(plan, on_progress=lambda seconds: None)
recording = read_recording(out)
recording

# %%
device = identify(recording, IdentificationSettings(order=12, draws=0))
device.identified

# %% [markdown]
# A second of 20 Hz along x that fades in and out. `equalize` is the finite-horizon tracker. It refuses forces above the
# cap, and reports the predicted error.

# %%
time_s = np.arange(1000) / 1000.0
wanted = np.zeros((1000, 3))
wanted[:, 0] = 2.0 * np.sin(np.pi * time_s) ** 2 * np.sin(2 * np.pi * 20.0 * time_s)
model = device.identified.model
forces = equalize(model, Signal(wanted, 1000.0, "acceleration", "m/s^2", model.output_channels))
forces
