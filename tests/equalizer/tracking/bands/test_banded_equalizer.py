"""On the synthetic device, played through a model that knows 5 to 35 Hz and is wrong above, as an identified one is."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.tracking.bands.banded_equalizer import BandedEqualizer, CapPolicy, HighBand, LowBand
from equalizer.tracking.bands.high_band import ModelledResponse
from equalizer.tracking.bands.rigid_model import fit_rigid_model
from equalizer.tracking.bands.stylus import StylusActuator
from equalizer.tracking.feedforward.band_split import BandEdges, CausalSplit, LinearPhaseSplit
from equalizer.tracking.feedforward.quality import measure_quality
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.lqr.limits import ForceLimitError
from equalizer.tracking.lqr.tracking_problem import TrackingWeights

RATE_HZ, TAPS = 1000.0, 4
WHOLE = BandEdges(None, None)


@pytest.fixture(scope="module")
def device(plants):
    return plants.omega_like()


@pytest.fixture(scope="module")
def band_model(device) -> IdentifiedModel:
    """Order 26: the device's modes below 50 Hz, and four taps fitted to what is left from 4 to 38 Hz."""
    values, vectors = np.linalg.eig(device.A)
    inputs, outputs = np.linalg.solve(vectors, device.B.astype(complex)), device.C @ vectors
    A, B, C = [], [], []
    for i in np.flatnonzero((np.abs(np.log(values + 1e-300)) < 2 * np.pi * 50 / RATE_HZ) & (values.imag >= 0)):
        a, b = values[i].real, values[i].imag
        single = b < 1e-9
        A.append([[a]] if single else [[a, b], [-b, a]])
        B.append([inputs[i].real] if single else [inputs[i].real, -inputs[i].imag])
        C.append(outputs[:, [i]].real if single else 2 * np.column_stack([outputs[:, i].real, outputs[:, i].imag]))
    lines = np.arange(4.0, 38.0, 0.25)
    z = np.exp(2j * np.pi * lines / RATE_HZ)[:, None, None]
    A, B, C = block_diag(*A), np.vstack(B), np.hstack(C)
    rest = (device.response(lines) - C @ np.linalg.solve(z * np.eye(len(A)) - A, B.astype(complex)[None])).reshape(
        -1, 9
    )
    basis = z[:, 0] ** -np.arange(TAPS + 1)
    damped = np.vstack([basis.real, basis.imag, 1e-3 * np.sqrt(len(lines)) * np.eye(TAPS + 1)])
    taps = np.linalg.lstsq(damped, np.vstack([rest.real, rest.imag, np.zeros((TAPS + 1, 9))]))[0].reshape(-1, 3, 3)
    A = block_diag(A, np.eye(3 * TAPS, k=-3))
    B = np.vstack([B, np.eye(3), np.zeros((3 * TAPS - 3, 3))])
    names = ("fx", "fy", "fz"), ("ax", "ay", "az")
    return IdentifiedModel(A, B, np.hstack([C, *taps[1:]]), taps[0], RATE_HZ, (5.0, 35.0), "N", "m/s^2", *names)


@pytest.fixture(scope="module")
def low(device) -> LowBand:
    lines = np.arange(0.5, 4.05, 0.1)
    return LowBand(fit_rigid_model(lines, device.response(lines), RATE_HZ))


@pytest.fixture(scope="module")
def high(device_model) -> HighBand:
    return HighBand(ModelledResponse(device_model))


@pytest.fixture(scope="module")
def impact():
    """(500, 3), m/s²: 20 Hz, and 60 Hz at half its size that decays sooner."""
    t = np.arange(500) / RATE_HZ
    wave = 20 * np.exp(-t / 0.05) * np.sin(2 * np.pi * 20 * t) + 10 * np.exp(-t / 0.017) * np.sin(2 * np.pi * 60 * t)
    return wave[:, None] * np.array([1, 0.3, -0.4])


@pytest.fixture(scope="module")
def in_time(device):
    """(played by the true device, wanted), rows one to one."""

    def play(found, wanted):
        late = np.zeros_like(found.total_forces)
        late[found.find_reference_rows(len(wanted))] = wanted
        return device.play(found.total_forces), late

    return play


def part(samples, low_hz, high_hz):
    n = 8 * len(samples)
    lines = np.fft.rfftfreq(n, 1 / RATE_HZ)
    return np.fft.irfft(np.fft.rfft(samples, n, axis=0) * ((lines >= low_hz) & (lines <= high_hz))[:, None], n, axis=0)


def in_band_error(played, wanted):
    return np.linalg.norm(part(played - wanted, 5, 35)) / np.linalg.norm(part(wanted, 5, 35))


def above_band(played, wanted):
    """What comes above the band over what is wanted there, rms."""
    return np.linalg.norm(part(played, 36, 450)) / np.linalg.norm(part(wanted, 36, 450))


@pytest.mark.slow
def test_an_impact_with_content_above_the_band_is_played_as_strongly_as_wanted(band_model, low, high, impact, in_time):
    split = LinearPhaseSplit(BandEdges(), RATE_HZ, 4.0)
    banded = in_time(BandedEqualizer(band_model, split, low, high).compute_forces(impact), impact)
    plain = in_time(BandedEqualizer(band_model, LinearPhaseSplit(WHOLE, RATE_HZ)).compute_forces(impact), impact)
    assert above_band(*plain) > 5
    assert above_band(*banded) == pytest.approx(1.0, abs=0.03)
    assert in_band_error(*banded) < 0.005 < in_band_error(*plain)


@pytest.mark.slow
def test_the_split_leaves_the_middle_band_flat_and_without_coupling(device, band_model, low, high):
    lines, period = np.arange(20, 141), 4000
    spectrum = np.zeros(period // 2 + 1, complex)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(1).random(len(lines))) * period / 20
    wave = np.tile(np.fft.irfft(spectrum, period), 3)
    delivered = np.empty((len(lines), 3, 3), complex)
    equalizer = BandedEqualizer(band_model, LinearPhaseSplit(BandEdges(), RATE_HZ), low, high)
    for axis in range(3):
        wanted = wave[:, None] * np.eye(3)[axis]
        found = equalizer.compute_forces(wanted)
        middle = device.play(found.total_forces)[found.find_reference_rows(len(wanted))][period : 2 * period]
        delivered[:, :, axis] = np.fft.rfft(middle, axis=0)[lines] / spectrum[lines, None]
    found = measure_quality(delivered)
    assert found.flatness_db <= 0.1
    assert found.coupling_db <= -40


def test_from_a_contact_on_a_wide_band_model_beats_the_causal_split(
    band_model, device_model, low, high, impact, in_time
):
    split = CausalSplit(BandEdges(), RATE_HZ)
    banded = in_time(BandedEqualizer(band_model, split, low, high).compute_forces(impact), impact)
    plain = in_time(BandedEqualizer(band_model, CausalSplit(WHOLE, RATE_HZ)).compute_forces(impact), impact)
    wide = in_time(BandedEqualizer(device_model, CausalSplit(WHOLE, RATE_HZ)).compute_forces(impact), impact)

    def error(pair):
        return np.linalg.norm(pair[0] - pair[1]) / np.linalg.norm(pair[1])

    assert error(wide) < 0.15 < error(banded) < 0.5 * error(plain)


def test_latency_is_that_of_the_split_and_of_the_room_before(band_model, low, high, impact):
    late = BandedEqualizer(band_model, LinearPhaseSplit(BandEdges(), RATE_HZ, 4.0), low, high)
    at_once = BandedEqualizer(band_model, CausalSplit(BandEdges(), RATE_HZ), low, high)
    only_above = BandedEqualizer(band_model, LinearPhaseSplit(BandEdges(None, 36.0), RATE_HZ, 4.0), None, high)
    assert [late.latency_ms, only_above.latency_ms, at_once.latency_ms] == pytest.approx([2364, 754, 0])
    assert late.compute_forces(impact).latency_samples == 2364


def test_the_predicted_acceleration_is_that_of_the_device(band_model, low, high, impact, in_time):
    found = BandedEqualizer(band_model, LinearPhaseSplit(BandEdges(), RATE_HZ, 4.0), low, high).compute_forces(impact)
    played, _ = in_time(found, impact)
    assert np.linalg.norm(found.predicted_total - played) < 1e-3 * np.linalg.norm(played)
    assert np.allclose(sum(found.by_band), found.total_forces)


@pytest.mark.slow
def test_above_the_cap_is_refused_or_solved_for(band_model, high, impact):
    equalizer = BandedEqualizer(band_model, LinearPhaseSplit(BandEdges(None, 36.0), RATE_HZ, 8.0), None, high)
    free = equalizer.compute_forces(impact)
    peak_n = float(np.linalg.norm(free.total_forces, axis=1).max())
    with pytest.raises(ForceLimitError, match="nothing was clipped"):
        equalizer.compute_forces(impact, CapPolicy(0.8 * peak_n))
    capped = equalizer.compute_forces(impact, CapPolicy(0.8 * peak_n, constrain=True))
    assert np.linalg.norm(capped.total_forces, axis=1).max() <= 0.8 * peak_n
    assert capped.loss.error_free < capped.loss.error_capped < capped.loss.error_clipped
    assert equalizer.compute_forces(impact, CapPolicy(1.01 * peak_n)).peaks.is_under_cap


def test_without_a_spring_the_numbers_of_forces_and_of_accelerations_may_differ(device_model):
    model = replace(device_model, C=device_model.C[:2], D=device_model.D[:2], output_channels=("ax", "ay"))
    found = BandedEqualizer(model, LinearPhaseSplit(WHOLE, RATE_HZ)).compute_forces(np.eye(2)[np.zeros(50, int)])
    assert np.array_equal(found.commands, found.total_forces) and found.commands.shape[1] == 3


def test_a_stylus_takes_force_off_the_motors(band_model, high, impact):
    lines = np.arange(40.0, 450.0, 5.0)
    stylus = StylusActuator(lines, np.full(len(lines), 30 + 5j), 50.0, 10.0)
    split = LinearPhaseSplit(BandEdges(None, 36.0), RATE_HZ, 4.0)
    without = BandedEqualizer(band_model, split, None, high).compute_forces(impact)
    with_it = BandedEqualizer(band_model, split, None, HighBand(high.source, stylus=stylus)).compute_forces(impact)
    assert with_it.stylus.command.shape == (len(with_it.commands),)
    assert np.linalg.norm(with_it.by_band[2]) < 0.8 * np.linalg.norm(without.by_band[2])


def test_a_stylus_from_a_contact_on_is_refused(band_model, low, high):
    """Its share has zero phase: its command would begin before the contact, and wrap around to the end."""
    stylus = StylusActuator(np.array([40.0, 450.0]), np.full(2, 30 + 5j), 50.0, 10.0)
    with pytest.raises(ValueError, match="no causal form.*use a linear-phase split, or leave the stylus out"):
        BandedEqualizer(band_model, CausalSplit(BandEdges(), RATE_HZ), low, HighBand(high.source, stylus=stylus))


@pytest.mark.slow
def test_the_rendered_spring_is_left_its_part(band_model, low, high):
    t, spring = np.arange(2000) / RATE_HZ, VirtualSpring(200.0, 3.0)
    wanted = (np.sin(2 * np.pi * 10 * t) * np.hanning(2000))[:, None] * np.array([1.0, 0, 0])
    split = LinearPhaseSplit(BandEdges(), RATE_HZ, 4.0)
    found = BandedEqualizer(band_model, split, low, high, spring=spring).compute_forces(wanted)
    by_spring = (found.total_forces - found.commands)[found.find_reference_rows(2000)]
    turning = np.exp(-2j * np.pi * 10 * t)
    expected = spring.compute_force_per_acceleration(np.array([10.0]))[0] * (turning @ wanted[:, 0])
    assert abs(turning @ by_spring[:, 0] - expected) < 0.01 * abs(expected)
    bare = BandedEqualizer(band_model, split, low, high).compute_forces(wanted)
    assert np.array_equal(bare.commands, bare.total_forces)
    assert np.allclose(bare.total_forces, found.total_forces)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"low": None}, "the split has a low band with the edge 4 Hz, but there is no model to play it"),
        ({"high": None}, "the split has a high band with the edge 36 Hz, but there is no model to play it"),
        ({"split": LinearPhaseSplit(BandEdges(4.0, None), RATE_HZ)}, "a model for a high band, but the split has none"),
        ({"split": LinearPhaseSplit(BandEdges(), 2000.0)}, "the split is at 2000 Hz, the model at 1000 Hz"),
        ({"weights": TrackingWeights(1e-6)}, r"weight is 1e-06; it must be within 0\.001 and 0\.01"),
    ],
)
def test_bands_without_models_are_refused(band_model, low, high, change, said):
    parts = {"split": LinearPhaseSplit(BandEdges(), RATE_HZ), "low": low, "high": high} | change
    with pytest.raises(ValueError, match=said):
        BandedEqualizer(band_model, **parts)


def test_the_band_model_is_good_inside_and_wrong_above(device, band_model):
    inside, above = np.arange(5.0, 35.0, 0.25), np.array([84.0])
    assert band_model.order == 26
    assert np.abs(compute_model_response(band_model, inside) - device.response(inside)).max() < 0.02
    assert np.abs(device.response(above)).max() > 5 * np.abs(compute_model_response(band_model, above)).max()
