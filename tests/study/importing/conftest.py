"""Files of arrays to be imported."""

import numpy as np
import pytest

from tests.recording_maps import U, Y


@pytest.fixture
def files(tmp_path):
    def write(name="a.npz", **arrays):
        np.savez(tmp_path / name, **(arrays or {"u": U, "y": Y}))
        return tmp_path / name

    return write
