"""One sound file of each kind that hapteq reads."""

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat

FROZEN = Path(__file__).parents[4] / "frozen" / "v0_1"
LIVE = {
    "format": "hapteq-live", "version": 1, "utc": "2026-01-01T00:00:00+00:00", "activity": "answer",
    "since_utc": "2026-01-01T00:00:00+00:00", "fault": "", "offset_mm": 0.5, "handle_ready": True,
    "acceleration_mps2": None, "sensor_clipped": False, "missed_ticks": 0,
}  # fmt: skip
REQUEST = {
    "format": "hapteq-request",
    "version": 1,
    "request": "note",
    "who": "experimenter",
    "text": "a",
    "adverse": True,
}


def corpus(folder: Path) -> list[Path]:
    """One sound file of each kind: the frozen ones, and foreign ones made here."""
    folder.mkdir()
    for name in ("model.h5", "lever.h5", "forces.csv", "wanted.csv", "twin.toml", "corpus_recording.toml",
                 "corpus_study.toml", "lever_map.toml", "lever.csv"):  # fmt: skip
        shutil.copy(FROZEN / name, folder)
    session = FROZEN / "study" / "P01_001"
    others = ("found/diagnosis.json", "study/corpus.lock.json", "study/P03_001/withdrawn.json")
    trial = session / "recordings" / "run-00_trial-000_attempt-0.h5"
    for path in (*session.glob("*.*"), *(FROZEN / name for name in others), trial):
        shutil.copy(path, folder)
    u = np.random.default_rng(0).normal(size=(400, 2))
    arrays = {"t": np.arange(400) / 1e3, "force": u, "acceleration": u[::-1].copy(), "fs": 1000.0}
    np.savez_compressed(folder / "packed.npz", **arrays)
    np.savez(folder / "plain.npz", **arrays)
    np.save(folder / "single.npy", u)
    savemat(
        folder / "plain.mat", {"data": {"u": u, "deep": {"fs": 1e3}}, "note": "a", "cells": np.array([u, 1], object)}
    )
    savemat(folder / "packed.mat", arrays, do_compression=True)
    for name in ("foreign.h5", "matlab.mat"):
        with h5py.File(folder / name, "w") as file:
            for key, value in arrays.items():
                file[f"run/{key}"] = value
            file.create_dataset("run/packed", data=u, compression="gzip", chunks=(50, 2))
            file["note"] = "text"
    (folder / "live.json").write_text(json.dumps(LIVE))
    (folder / "note-1.json").write_text(json.dumps(REQUEST))
    return sorted(folder.iterdir())
