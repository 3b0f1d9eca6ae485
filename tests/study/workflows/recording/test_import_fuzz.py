"""Tables of random layouts with known contents are read right, or refused with what mends them."""

from collections import Counter

import numpy as np
import pytest

from study.errors import StudyError
from study.importing.map_format.map_errors import MapNeededError
from study.workflows.recording.import_recording import read_foreign
from tests.drawn_tables import draw_table
from tests.slow_instances import slow


def read_or_refuse(path, drawn):
    """Whether the table was read; what was read is right."""
    path.write_bytes(drawn.data)
    try:
        found = read_foreign((path,), None).recording
    except StudyError as refused:
        said = refused.skeleton if isinstance(refused, MapNeededError) else refused.do_now
        assert refused.happened, said
        assert said, refused.happened
        return False
    assert found.sample_rate_hz == pytest.approx(drawn.rate_hz, rel=1e-6)
    for name, values in zip(drawn.names, drawn.values.T, strict=True):
        signal = found.command if name in found.command.channels else found.response
        samples = signal.samples[:, signal.channels.index(name)]
        np.testing.assert_allclose(samples, values, rtol=1e-9, atol=1e-12)
    return True


@pytest.mark.parametrize("begin", [0, *slow(*range(50, 250, 50))])
def test_a_table_of_any_layout_is_read_right_or_refused(tmp_path, begin):
    seen = Counter()
    for seed in range(begin, begin + 50):
        drawn = draw_table(np.random.default_rng(seed))
        read = read_or_refuse(tmp_path / "a.csv", drawn)
        assert read or drawn.layout.open, f"seed {seed}: {drawn.layout} was refused"
        seen[read] += 1
    assert seen[True] > 25
