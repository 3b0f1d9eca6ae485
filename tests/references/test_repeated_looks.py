"""What asking for the same trial again is worth, measured again in small."""

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from repeated_looks import gain_db


def test_repeats_without_a_limit_lower_a_threshold_and_three_hardly_do():
    """2.2 ± 0.2 and 0.4 ± 0.2 dB over 150 runs; bounds are three standard errors of 60."""
    (unlimited, many), (three, few) = gain_db(math.inf, 60), gain_db(3.0, 60)
    assert unlimited.mean() > 1.0
    assert abs(three.mean()) < 1.5
    assert unlimited.mean() > three.mean()
    assert many > 20
    assert few <= 3
