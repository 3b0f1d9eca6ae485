# %% [markdown]
# # Import a table of your own
#
# A table with names and units in its header needs no map: both are read from it. Units are converted to SI.

# %%
import tempfile
from pathlib import Path

import numpy as np

from analysis import overview
from study import ImportPlan, import_recording

folder = Path(tempfile.mkdtemp(prefix="hapteq-example-"))
time_s = np.arange(5000) / 500.0
current_a = np.sin(2 * np.pi * 3.0 * time_s)
angle_deg = 12.0 * np.sin(2 * np.pi * 3.0 * time_s - 0.4)
table = np.column_stack([time_s, current_a, angle_deg])
np.savetxt(folder / "motor.csv", table, delimiter=",", header="time [s],current [A],angle [deg]", comments="")

# %%
imported = import_recording(ImportPlan((folder / "motor.csv",), map=None, out=folder / "motor.h5"))
imported.recording

# %%
for note in imported.notes:
    print(note)

# %% [markdown]
# The contents and the checks of the recording, before any model.

# %%
overview("motor", imported.recording)
