"""A bank of concealed-physics cases: what is drawn, each one's diagnosis as a line of JSON, and what all lines say.

Run with a file and numbers of cases, it adds their lines to the file: `python diagnosis_bank.py LINES.jsonl 0 2 4`.
"""

import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from statsmodels.stats.proportion import proportion_confint

from analysis.diagnosis.diagnose import DiagnosisSettings, diagnose
from analysis.diagnosis.findings import Findings
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.challenge.draw_case import DECOYS, EFFECTS, Truth, draw_case

FIRST_SEED = 52_021
DETECTABLE = 1.25
"""Of a re-tuned model's errors over the noise, in the worst channel, on what was kept for the test."""
TURN = ("single", "single", "nothing", "single", "outside", "single", "pair", "single", "nothing", "without")
"""What is drawn, in turn: one effect, none, one of no catalogue, two, and one that the diagnosis must do without."""


@dataclass(frozen=True)
class Draw:
    number: int
    kind: str
    effects: tuple[str, ...]
    concealed: str
    strength: tuple[float, ...]


def draw(number: int) -> Draw:
    """The same for the same number, however many there are."""
    random = np.random.default_rng([FIRST_SEED, number])
    kind = TURN[number % len(TURN)]
    names = list(DECOYS if kind == "outside" else EFFECTS)
    if kind in ("single", "without"):
        # One after another, so that no effect waits long for its turn.
        order = np.random.default_rng(FIRST_SEED).permutation(names)
        singles = [k for k in range(number) if TURN[k % len(TURN)] in ("single", "without")]
        effects = (str(order[len(singles) % len(names)]),)
    else:
        count = {"nothing": 0, "outside": 1, "pair": 2}[kind]
        effects = tuple(str(name) for name in random.choice(names, count, replace=False))
    lowest = {"single": 0.15, "without": 0.4, "pair": 0.5}.get(kind, 0.6)
    concealed = "calibrated" if "hand_impedance" in effects else str(random.choice(["calibrated", "retuned"]))
    return Draw(number, kind, effects, concealed, tuple(float(s) for s in random.uniform(lowest, 1.0, len(effects))))


def line_of(one: Draw) -> dict[str, object]:
    """A diagnosis, and how it compares with the truth."""
    case = draw_case(FIRST_SEED + one.number, one.effects, one.concealed, one.strength or None)
    began = time.perf_counter()
    without = one.effects if one.kind == "without" else ()
    found = diagnose([case.recording], case.model, DiagnosisSettings(without=without), map, lambda what, share: None)
    said, test = found.diagnosis, found.diagnosis.fit.test
    return asdict(one) | {
        "seconds": time.perf_counter() - began,
        "verdict": said.verdict,
        "named": [effect.effect for effect in said.effects],
        "set": [[effect.effect, *(r.effect for r in effect.rivals if r.inseparable)] for effect in said.effects],
        "place_right": [_right(found, truth, "place") for truth in case.truth],
        "axis_right": [_right(found, truth, "axis") for truth in case.truth],
        "main_error": [_main_error(found, truth) for truth in case.truth],
        "probability": [effect.probability for effect in said.effects],
        "detectable": max(found.channel_errors["retuned"].values()) > DETECTABLE,
        "errors": [test.before, test.retuned, test.after, test.noise],
    }


def _right(found: Findings, truth: Truth, what: str) -> bool | None:
    """Of the effect that was named for it, else of the first that was named; None where there is none, or nothing to
    be right about."""
    named = found.diagnosis.effects
    own = next((one for one in named if one.effect == truth.effect), named[0] if named else None)
    if own is None or (what == "axis" and (truth.axis is None or own.axis is None)):
        return None
    return bool(getattr(own, what) == getattr(truth, what))


def _main_error(found: Findings, truth: Truth) -> float | None:
    own = next((one for one in found.diagnosis.effects if one.effect == truth.effect), None)
    known = EFFECTS_BY_NAME.get(truth.effect)
    if own is None or known is None or known.main.name not in truth.values:
        return None
    true = truth.values[known.main.name]
    return abs(own.parameters[known.main.name].value - true) / abs(true) if true else None


@dataclass(frozen=True)
class Share:
    """So many of so many, with Wilson's 95 % interval."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        return self.hits / self.of if self.of else float("nan")

    @property
    def text(self) -> str:
        if not self.of:
            return "none drawn"
        low, high = proportion_confint(self.hits, self.of, method="wilson")
        return f"{100 * self.value:5.1f} % [{100 * low:.0f}, {100 * high:.0f}]  {self.hits} of {self.of}"


def share(lines, right) -> Share:
    return Share(sum(bool(right(one)) for one in lines), len(lines))


def shares(lines) -> dict[str, Share]:
    """By the words of a table."""
    seen = [one for one in lines if one["detectable"]]
    by_kind = {kind: [one for one in seen if one["kind"] == kind] for kind in set(TURN)}
    single, pair = by_kind["single"], by_kind["pair"]
    alone = [one for one in single if len(one["named"]) == 1 and len(one["set"][0]) == 1]
    axes = [one for one in single if one["axis_right"][0] is not None]
    return {
        "named right": share(single, lambda one: one["named"] == one["effects"]),
        "in the returned set": share(single, lambda one: any(one["effects"][0] in names for names in one["set"])),
        "right where one name is returned": share(alone, lambda one: one["named"] == one["effects"]),
        "place": share([one for one in single if one["named"]], lambda one: one["place_right"][0]),
        "axis": share(axes, lambda one: one["axis_right"][0]),
        "nothing missing, no name": share([x for x in lines if x["kind"] == "nothing"], lambda one: not one["named"]),
        "outside the catalogue, not explained": share(
            by_kind["outside"], lambda one: one["verdict"] in ("unexplained", "partly_explained")
        ),
        "without the true effect, not explained": share(by_kind["without"], lambda one: one["verdict"] != "explained"),
        "pairs, both": share(pair, lambda one: set(one["effects"]) == set(one["named"])),
        "pairs, at least one": share(pair, lambda one: set(one["effects"]) & set(one["named"])),
    }


def medians(lines) -> dict[str, float]:
    single = [one for one in lines if one["kind"] == "single" and one["detectable"]]
    right = [one for one in single if one["named"] == one["effects"]]
    named = [one for one in lines if one["named"] and one["kind"] in ("single", "pair")]
    return {
        "mean size of the set": _of(np.mean, [len(one["set"][0]) for one in single if one["set"]]),
        "main parameter's error, median": _of(np.median, [one["main_error"][0] for one in right]),
        "held-out error after / noise, median": _of(
            np.median, [one["errors"][2] / one["errors"][3] for one in named if one["errors"][3]]
        ),
        "seconds, median": _of(np.median, [one["seconds"] for one in lines]),
    }


def _of(statistic, values) -> float:
    known = [value for value in values if value is not None]
    return float(statistic(known)) if known else float("nan")


def row(one) -> str:
    truth = f"{one['kind']}: {' + '.join(one['effects'])}" if one["effects"] else "nothing"
    named = " + ".join("|".join(names) for names in one["set"]) or "-"
    error = ", ".join("-" if value is None else f"{100 * value:.1f} %" for value in one["main_error"]) or "-"
    errors = " ".join("  -   " if value is None else f"{value:.4f}" for value in one["errors"])
    seen = "" if one["detectable"] else " (not detectable)"
    head = f"{one['number']:4d} {truth + seen:58.58s} {one['verdict']:16s} {named:58.58s}"
    return f"{head} {error:>8s}  {errors} {one['seconds']:5.0f} s"


HEAD = (
    f"{'':4s} {'truth':58s} {'verdict':16s} {'named, inseparable ones after a bar':58s} {'main':>8s}  "
    "before re-tuned after noise"
)


def main(arguments: list[str]) -> None:
    for number in arguments[1:]:
        line = json.dumps(line_of(draw(int(number))))
        with Path(arguments[0]).open("a", encoding="utf-8") as file:
            file.write(line + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
