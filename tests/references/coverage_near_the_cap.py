"""Bias and coverage of the primary analysis near the cap, by curve and lapse rate. It goes on where it stopped.

    python tests/references/coverage_near_the_cap.py FOLDER [SECONDS [SEED]]
    python tests/references/coverage_near_the_cap.py FOLDER 0     only prints what is there

Studies of ten participants under the published staircase. Of the medians, 0.35 and 0.85 N are far below the cap of 3 N;
at 2.5 N, 70 % of the people lie below it, at 3 N half of them, at 4 N a fifth. The analysis assumes Weibull curves
throughout. Each interval is counted as the report prints it: two-sided where the estimate is below the cap, a one-sided
bound where it is above. In turn there are studies of equal medians above the cap with unequal spread (type-1 errors).
"""

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from analysis.psychophysics.catch_trials import compute_wilson_interval
from analysis.psychophysics.group_contrasts import compute_contrasts
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.inference import compute_pseudo_thresholds, estimate_medians
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.repeated_measures import analyse_repeated_measures
from analysis.psychophysics.two_analyses import SIMULATED_RULE
from protocols.procedure.staircase import to_db

HZ, MEDIANS_N, UNEQUAL = (5.0, 15.0, 25.0, 35.0, 45.0), (0.35, 0.85, 2.5, 3.0, 4.0), (1.0, 1.0, 1.7, 2.5, 3.5)
PEOPLE, SEED, NULL = 10, 41, "3.5 N, unequal spread"
CELLS = {
    f"{family.value}, {100 * lapse:g} %": Crowd(HZ, MEDIANS_N, lapse=lapse, family=family)
    for family in Family
    for lapse in (0.0, 0.02, 0.05)
}
TURN = (*CELLS, NULL, NULL, NULL)


def judge(crowd: Crowd, seed: tuple[int, ...]) -> dict[str, list[float] | list[bool]]:
    study = simulate_study(crowd, SIMULATED_RULE, PEOPLE, seed)
    fit = fit_hierarchy(study.answers)
    pseudo, true_db = compute_pseudo_thresholds(fit), 20.0 * np.log10(crowd.medians_n)
    medians = estimate_medians(fit, to_db(SIMULATED_RULE.cap_n), 0.95)
    found, true_differences = compute_contrasts(HZ, pseudo, 0.95), true_db[1:] - true_db[0]
    pairs = list(zip(found, true_differences, strict=True))
    return {
        "error": [float(m.db - true) for m, true in zip(medians, true_db, strict=True)],
        "above": [m.above_cap for m in medians],
        "too high": [m.lower_db is not None and bool(m.lower_db > t) for m, t in zip(medians, true_db, strict=True)],
        "too low": [m.upper_db is not None and bool(m.upper_db < t) for m, t in zip(medians, true_db, strict=True)],
        "contrast error": [float(c.difference_db - true) for c, true in pairs],
        "contrast covers": [bool(c.lower_db <= true <= c.upper_db) for c, true in pairs],
    }


def judge_null(seed: tuple[int, ...]) -> dict[str, list[float]]:
    study = simulate_study(Crowd(HZ, (3.5,) * 5, frequency_sd_db=UNEQUAL), SIMULATED_RULE, PEOPLE, seed)
    pseudo = compute_pseudo_thresholds(fit_hierarchy(study.answers))
    overall = analyse_repeated_measures(study.answers.subjects, pseudo.tolist()).p_huynh_feldt
    return {"p": [1.0 if overall is None else overall, *(c.p for c in compute_contrasts(HZ, pseudo, 0.95))]}


def simulate(folder: Path, seconds: float, seed: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    path, until = folder / "studies.jsonl", time.monotonic() + seconds
    done = len(path.read_text().splitlines()) if path.exists() else 0
    with path.open("a") as file:
        while time.monotonic() < until:
            number, place = divmod(done, len(TURN))
            part, key = TURN[place], (seed, place, number)
            row = {"part": part, **(judge_null(key) if part == NULL else judge(CELLS[part], key))}
            file.write(json.dumps(row) + "\n")
            file.flush()
            done += 1


def print_results(folder: Path) -> None:
    rows = [json.loads(line) for line in (folder / "studies.jsonl").read_text().splitlines()]
    for part in (*CELLS, "all"):
        mine = [row for row in rows if row["part"] == part or (part == "all" and row["part"] != NULL)]
        print(f"{part} ({len(mine)} studies)")  # noqa: T201
        for line in _cell_lines(mine):
            print(f"    {line}")  # noqa: T201
    p = np.array([row["p"] for row in rows if row["part"] == NULL])
    shares = [_share(column < 0.05) for column in p.T]
    print(f"{NULL} ({len(p)} studies): p < 0.05 overall {shares[0]}; contrasts {'; '.join(shares[1:])}")  # noqa: T201


def _cell_lines(rows: list[dict[str, list[float]]]) -> list[str]:
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0] if name != "part"}
    above, missed = columns["above"].astype(bool), (columns["too high"] + columns["too low"]) > 0
    lines = []
    for place, median_n in enumerate(MEDIANS_N):
        bounds = _share(~missed[above[:, place], place]) if above[:, place].any() else "none"
        line = f"{median_n:g} N: bias {columns['error'][:, place].mean():+.2f} dB; holds {_share(~missed[:, place])}"
        line += f"; {above[:, place].sum()} bounds hold {bounds}"
        if place:
            covers, error = columns["contrast covers"][:, place - 1], columns["contrast error"][:, place - 1]
            line += f"; contrast {error.mean():+.2f} dB, holds {_share(covers)}"
        lines.append(line)
    return lines


def _share(found: np.ndarray) -> str:
    lower, upper = compute_wilson_interval(int(np.sum(found)), len(found))
    return f"{100 * np.mean(found):.1f} % ({100 * lower:.1f} to {100 * upper:.1f})"


if __name__ == "__main__":
    where, asked = Path(sys.argv[1]), sys.argv[2:]
    simulate(where, float(asked[0]) if asked else 600.0, int(asked[1]) if len(asked) > 1 else SEED)
    print_results(where)
