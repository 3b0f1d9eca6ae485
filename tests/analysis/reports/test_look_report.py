import numpy as np

from analysis.look.overview import make_overview
from analysis.reports.look_report import summarise_overview
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal


def test_a_single_channel_and_segment_are_counted_in_the_singular():
    noise = np.random.default_rng(1).standard_normal((2000, 1))
    command, response = Signal(noise, 500.0, "force", "N", ("f",)), Signal(noise, 500.0, "position", "m", ("x",))
    recording = Recording("rig", command, response, segments=(Segment(0, 2000, "noise"),))
    assert "Hz, 2 channels, 1 segment; checks:" in summarise_overview(make_overview("rig", recording))
