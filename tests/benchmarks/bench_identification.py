"""Identification against live peers on the same data: a synthetic device with a known truth, 30 s sweeps per axis.

    bench_identification.py [--peers ctrlsys,pymor] [--seeds 5] [--quick]

Each peer runs in an environment of its own (.venv-peers, made when first needed), each method in a process of its own
with one thread; CPU seconds, because the machine may be shared. A peer that cannot be installed, or that fails, is a
row that says why.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent / "peers"))
from environments import NotInstalledError, last_line, python_of
from exchange import Data, read_model
from peer_table import PEERS, Method, Peer
from scores import Score, score, score_of_estimate
from synthetic import Experiment, write_data
from table_rows import HEAD, Row, percent, report, shown

ROOT = Path(__file__).resolve().parents[2]
RUNNERS = Path(__file__).resolve().parent / "peers"
PATIENCE_S = 240.0
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "JAX_PLATFORMS": "cpu"}

OURS = "run_hapteq.py"
BAND, WIDE = (5.0, 35.0), (35.0, 450.0)
HELD_OUT, WORST_LINE, CPU_S, OF_PEER = 0.002, 0.01, 5.0, 0.4
"""Bars: ours on its worst seed. Aim, and no bar: ours over the best peer, median to median. Set as its documents say
the strongest peer errs at 125 Hz or at 1 kHz; at 250 and 500 Hz it comes as near to what the noise allows as ours."""
WIDE_SWEEP_RMS, WIDE_RMS = 0.004, 0.0025

NARROW = Experiment((4.5, 37.0))
WIDE_SWEEPS = Experiment((1.0, 500.0))
WIDE_MODEL = Experiment((1.0, 500.0), (5.0, 450.0), 40)


class FailedError(Exception):
    pass


def modelled(python: Path, runner: str, data: Path, options: dict) -> tuple[Score, dict[str, str]]:
    """One method on one record, in its own process."""
    out = data.with_name("model.npz")
    paths = {"PYTHONPATH": str(ROOT)} if Path(python) == Path(sys.executable) else {}
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | ONE_THREAD | paths
    command = [str(python), "-W", "ignore", str(RUNNERS / runner), str(data), str(out), json.dumps(options)]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        raise FailedError(f"stopped after {PATIENCE_S:.0f} s") from None
    if done.returncode:
        raise FailedError(last_line(done.stderr) or f"exit code {done.returncode}")
    model = read_model(out)
    out.unlink()
    return score(model, (BAND, WIDE) if options.get("wide") else (BAND,)), model.versions


def rows_of(label: str, python: Path, runner: str, method: Method, data: list[Path]) -> tuple[Row, dict[str, str]]:
    row, versions = Row(f"{label}: {method.label}", assisted=method.assisted), {}
    for number, path in enumerate(data[: method.seeds]):
        progress(f"{row.label}, seed {number}")
        try:
            scored, versions = modelled(python, runner, path, method.options)
            row.scores.append(scored)
        except FailedError as failure:
            row.failures.append(str(failure))
    return row, versions


def progress(text: str) -> None:
    sys.stderr.write(f"  running {text}\n")


def peer_rows(peers: list[Peer], data: list[Path], quick: bool) -> list[Row]:
    rows = []
    for peer in peers:
        progress(f"{peer.name}: its environment")
        try:
            python = python_of(peer)
        except NotInstalledError as reason:
            report(f"{peer.name:54} not installed: {reason}")
            continue
        told: dict[str, str] = {}
        for method in peer.methods:
            if quick and method.heavy:
                continue
            row, versions = rows_of(peer.name, python, peer.runner, method, data)
            told = versions or told
            rows.append(row)
            shown(row)
        report(f"    {peer.licence}; " + ", ".join(f"{name} {number}" for name, number in told.items()))
    return rows


def estimate_row(data: list[Data]) -> Row:
    return Row("the raw estimate, taken for a model", [score_of_estimate(each) for each in data])


def compared(ours: Row, rows: list[Row]) -> None:
    """Prints ours over the best peers."""
    ratios = []
    for who, some in (("peer by itself", [row for row in rows if not row.assisted]), ("peer with our B, D", rows)):
        if stable := [row for row in some if row.usable]:
            best = min(stable, key=lambda row: row.median("held_out"))
            ratios.append(ours.median("held_out") / best.median("held_out"))
            report(f"held-out error, ours / best {who}, stable each time: {ratios[-1]:.2f} ({best.label})")
        if ran := [row for row in some if row.scores]:
            best = min(ran, key=lambda row: row.rms)
            ratios.append(ours.rms / best.rms)
            report(f"rms error, ours / best {who}, stable or not: {ratios[-1]:.2f} ({best.label})")
            report(f"CPU, ours / the same: {ours.median('cpu_s') / best.median('cpu_s'):.2g}")
    if not ratios:
        report("no peer gave a model: nothing to divide by")
        return
    reached = "reached" if max(ratios) <= OF_PEER else "not reached"
    report(f"error ours / best peer, median to median, at worst: {max(ratios):.2f} (aim {OF_PEER}: {reached})")


def written(experiment: Experiment, seeds: int, folder: Path) -> tuple[list[Data], list[Path]]:
    data, paths = [], []
    for seed in range(seeds):
        drawn = experiment.data(seed)
        paths.append(folder / f"{experiment.sweep_hz[1]:.0f}_{experiment.order}_{seed}.npz")
        write_data(drawn, paths[-1])
        data.append(drawn)
    return data, paths


def ours_on(experiment: Experiment, seeds: int, folder: Path, label: str) -> Row:
    _, paths = written(experiment, seeds, folder)
    wide = experiment.band_hz[1] > BAND[1]
    row, _ = rows_of("hapteq", Path(sys.executable), OURS, Method(label, {"wide": wide}, seeds), paths)
    shown(row)
    return row


def narrow(peers: list[Peer], seeds: int, quick: bool, folder: Path) -> bool:
    data, paths = written(NARROW, seeds, folder)
    ours, versions = rows_of("hapteq", Path(sys.executable), OURS, Method("order 26, 1 kHz", {}, seeds), paths)
    shown(ours)
    report("    " + ", ".join(f"{name} {number}" for name, number in versions.items()))
    shown(estimate_row(data))
    if peers:
        compared(ours, peer_rows(peers, paths, quick))
    if not ours.usable:
        return False
    measured = {what: max(getattr(each, what) for each in ours.scores) for what in ("held_out", "worst_line", "cpu_s")}
    report(
        f"hapteq, worst seed: held out {percent(measured['held_out'])} (bar {percent(HELD_OUT)}), line "
        f"{percent(measured['worst_line'])} (bar {percent(WORST_LINE)}), {measured['cpu_s']:.1f} CPU s (bar {CPU_S:g})"
    )
    bars = {"held_out": HELD_OUT, "worst_line": WORST_LINE, "cpu_s": CPU_S}
    return all(measured[what] <= bar for what, bar in bars.items())


def wide(seeds: int, folder: Path) -> bool:
    report("\nSweeps of 1 to 500 Hz; rms and lines of 5 to 35 Hz")
    report(HEAD)
    swept = ours_on(WIDE_SWEEPS, seeds, folder, "order 26, 5 to 35 Hz")
    model = ours_on(WIDE_MODEL, seeds, folder, "order 40, 5 to 450 Hz")
    if not (swept.usable and model.usable):
        return False
    rms = max(each.rms[0] for each in swept.scores)
    low, high = (max(each.rms[band] for each in model.scores) for band in (0, 1))
    report(
        f"hapteq, worst seed: rms {percent(rms)} (bar {percent(WIDE_SWEEP_RMS)}); of the wide band "
        f"{percent(low)} in 5 to 35 Hz and {percent(high)} in 35 to 450 Hz "
        f"(bar {percent(WIDE_RMS)})"
    )
    return rms <= WIDE_SWEEP_RMS and max(low, high) <= WIDE_RMS


def options_of(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    names = [peer.name for peer in PEERS]
    parser.add_argument("--peers", default=",".join(names), help="names separated by commas, or none")
    parser.add_argument("--seeds", type=int, default=5, help="noise seeds; slow peers take fewer")
    parser.add_argument("--quick", action="store_true", help="no slow methods, no wide sweeps")
    options = parser.parse_args(arguments)
    chosen = [] if options.peers == "none" else options.peers.split(",")
    if unknown := set(chosen) - set(names):
        parser.error(f"unknown peers: {', '.join(sorted(unknown))}; known are {', '.join(names)}")
    options.peers = [peer for peer in PEERS if peer.name in chosen]
    return options


def main(arguments: list[str] | None = None) -> int:
    options = options_of(arguments)
    with tempfile.TemporaryDirectory() as name:
        report("Sweeps of 4.5 to 37 Hz, 2 x 30 s per axis, sensor noise; rms and lines of 5 to 35 Hz")
        report(HEAD)
        good = narrow(options.peers, options.seeds, options.quick, Path(name))
        if not options.quick:
            good = wide(options.seeds, Path(name)) and good
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
