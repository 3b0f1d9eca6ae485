"""A device that sticks is recorded, diagnosed against a model that knows nothing of it, and plays better at once.

The device steps its own equations (`tests/rubbing.py`) and shares no code with the models that are fitted to it.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.tracking.feedforward.trajectory import Trajectory
from study.cli.main import main
from study.store.formats.diagnosis_file import read_diagnosis
from study.store.formats.trajectory_file import read_trajectory, write_trajectory

CAP_N = 3.0
QUICKLY = ("coulomb_friction", "viscous_damping", "hardening_stiffness", "amplifier_lag")
"""Of the catalogue, for the time that it takes;"""
AT_LENGTH = (*QUICKLY, "stribeck_friction", "asymmetric_friction", "quadratic_damping", "force_deadband")
"""and where there is more of it."""


@pytest.fixture(scope="module")
def rubbing_handle(module_at, plants, rubbing):
    kind = module_at(Path(__file__).with_name("rubbing_handle.py")).RubbingHandle
    return lambda folder, seed: kind(plants, rubbing, folder, seed)


def closed_loop(handle, considered, *options):
    """Errors without and with the friction that was named, largest forces alike, and the diagnosis."""
    handle.prepare()
    found = handle.diagnose(tuple(name for name in EFFECTS_BY_NAME if name not in considered), *options)
    diagnosis = read_diagnosis(found / "diagnosis.json")
    plain, without_n = handle.first_play("plain")
    freed, with_n = handle.first_play("freed", "--physics", str(found / "improved.toml"))
    return diagnosis, plain, freed, max(without_n, with_n)


def named_right(diagnosis):
    assert [(effect.effect, effect.axis) for effect in diagnosis.effects] == [("coulomb_friction", "y")]
    assert diagnosis.effects[0].parameters["level"].value == pytest.approx(0.15, rel=0.08)
    assert diagnosis.fit.test.after < 0.25 * diagnosis.fit.test.retuned


@pytest.fixture(scope="module")
def once(rubbing_handle, tmp_path_factory):
    handle = rubbing_handle(tmp_path_factory.mktemp("loop"), 3)
    return handle, closed_loop(handle, QUICKLY, "--no-discovery")


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_friction_is_named_with_its_size_and_the_first_play_gets_better(once):
    _, (diagnosis, plain, freed, _) = once
    named_right(diagnosis)
    assert plain[2] > 0.1
    assert freed[2] < 0.25 * plain[2]
    assert freed[0] < 0.3 * plain[0]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_what_is_added_against_friction_stays_under_the_cap_with_the_rest(once):
    handle, (_, _, _, largest_n) = once
    assert largest_n <= CAP_N
    alone = equalized(handle, "wanted.csv", "alone.csv")
    wanted = read_trajectory(handle.folder / "wanted.csv").signal
    almost = 0.999 * CAP_N / np.linalg.norm(alone, axis=1).max()
    write_trajectory(handle.folder / "loud.csv", Trajectory(replace(wanted, samples=almost * wanted.samples)))
    physics = handle.folder / "found" / "improved.toml"
    both = equalized(handle, "loud.csv", "both.csv", "--physics", str(physics))
    assert np.abs(both - almost * alone).max() > 1e-4
    assert 0.99 * CAP_N < np.linalg.norm(both, axis=1).max() <= CAP_N


def equalized(handle, wanted, out, *options):
    """Forces (N, 3) by the model of the recordings that were freed of friction."""
    paths = [str(handle.folder / name) for name in ("freed.h5", wanted)]
    assert main(["equalize", *paths, "--out", str(handle.folder / out), *options]) == 0
    return read_trajectory(handle.folder / out).signal.samples


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_over_seeds_the_first_play_errs_a_fifth_of_what_it_did(rubbing_handle, tmp_path_factory, capsys):
    ratios, rows = [], []
    for seed in range(1, 6):
        handle = rubbing_handle(tmp_path_factory.mktemp(f"seed{seed}"), seed)
        diagnosis, plain, freed, largest_n = closed_loop(handle, AT_LENGTH)
        named_right(diagnosis)
        assert largest_n <= CAP_N
        ratios.append(freed[0] / plain[0])
        level = diagnosis.effects[0].parameters["level"].value
        rows.append(f"seed {seed}: {level:.3f} N, {100 * plain[0]:.1f} % to {100 * freed[0]:.1f} %")
    with capsys.disabled():
        spread = f"ratio {np.mean(ratios):.3f} +- {np.std(ratios, ddof=1):.3f}"
        sys.stdout.write("\n".join(["", *rows, spread, ""]))
    assert max(ratios) < 0.3
