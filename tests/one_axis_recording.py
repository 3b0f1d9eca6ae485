"""A recording of one simulated axis, as a laboratory would hand it on: an archive, its map, and the axis's model."""

import numpy as np
from scipy.signal import cont2discrete, lfilter

from tests.recording_maps import NOISE_ON_ONE_AXIS

RATE_HZ, SECONDS = 500.0, 8.0
MASS, DAMPING, STIFFNESS = 0.2, 4.0, 900.0
OFFSET = 1.5

MAP = f"""{NOISE_ON_ONE_AXIS}
[[segment]]
kind = "noise"
split = {{ fit = 0.7, test = 0.3 }}

[diagnosis]
model = "axis.model.toml"
nominal = {{ mass = 0.2 }}
objections = ["It is simulated."]
"""

MODEL = f"""
[model]
name = "one axis"
quantity = "acceleration"
mass = [[{MASS}]]
damping = [[{DAMPING}]]
stiffness = [[{STIFFNESS}]]
input = [[1.0]]
output = [[1.0]]

[tolerance]
mass_kg = 0.004
damping_n_s_per_m = 0.1
stiffness_n_per_m = 20.0
"""


def played(offset: float) -> dict[str, np.ndarray]:
    """Zero-order hold; the answer is taken just before the next command is written."""
    random = np.random.default_rng(4)
    n = int(RATE_HZ * SECONDS)
    u = lfilter([0.2], [1.0, -0.8], random.normal(size=n))
    a = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    exact = cont2discrete((a, np.array([[0.0], [1 / MASS]]), np.eye(2), np.zeros((2, 1))), 1 / RATE_HZ)
    state, y, held = np.zeros(2), np.zeros(n), 0.0
    for k in range(n):
        y[k] = a[1] @ state + held / MASS
        held = u[k]
        state = exact[0] @ state + exact[1][:, 0] * held
    return {"u": u, "y": y + offset + 0.01 * random.normal(size=n)}
