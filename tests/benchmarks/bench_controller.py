"""What a tick of an exported controller costs, order 26, compiled as docs/controller.md says; and against NumPy, which
gets the same sums as whole products: the numbers of a tick laid side by side, without split, caps and checks."""

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from study.store.formats.identified_model_file import write_identified_model
from study.workflows.equalizer.controller.export_controller import ControllerPlan, export_controller

sys.path.insert(0, str(Path(__file__).parents[1]))
import vendor_stub

ORDER = 26
ALLOWED_NS = 1000.0
RUNS = 7
PEER_TICKS = 20_000
FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror")


def model_file(folder: Path) -> Path:
    draw = np.random.default_rng(1).standard_normal
    A = draw((ORDER, ORDER))
    A *= 0.97 / np.abs(np.linalg.eigvals(A)).max()
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    B, C, D = draw((ORDER, 3)), draw((3, ORDER)), draw((3, 3))
    write_identified_model(
        folder / "model.h5", IdentifiedModel(A, B, C, D, 1000.0, (5.0, 35.0), "N", "m/s^2", *channels)
    )
    return folder / "model.h5"


def numpy_tick_ns(ahead: int) -> float:
    """The quickest of some runs. ahead: how many numbers come beside the state into a force."""
    draw = np.random.default_rng(2).standard_normal
    gain, model = draw((3, ahead + ORDER)), 0.1 * draw((ORDER + 3, ORDER + 3))
    known, state, quickest = draw(ahead + ORDER), np.zeros(ORDER + 3), np.inf
    for _ in range(RUNS):
        started_s = time.perf_counter()
        for _ in range(PEER_TICKS):
            known[ahead:] = state[:ORDER]
            force = gain @ known
            norm = float(np.sqrt(force @ force))
            state[ORDER:] = force if norm <= 3.0 else force * (3.0 / norm)
            state = model @ state
        quickest = min(quickest, (time.perf_counter() - started_s) / PEER_TICKS)
    return 1e9 * quickest


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "out"
        export_controller(ControllerPlan(model_file(Path(name)), out))
        preview = int(re.search(r"#define HAPTEQ_PREVIEW (\d+)", (out / "hapteq_controller.h").read_text()).group(1))
        command = [*vendor_stub.compiler(), *FLAGS, "-o", str(out / "check"), str(out / "check_controller.c"), "-lm"]
        subprocess.run(command, check=True, timeout=240)
        said = [
            subprocess.run([str(out / "check")], capture_output=True, text=True, check=True).stdout for _ in range(RUNS)
        ]
    taken = np.array([[float(each) for each in re.findall(r"(\d+) ns", text)] for text in said]).min(axis=0)
    by_numpy = np.array([numpy_tick_ns(9), numpy_tick_ns(3 * preview)])
    for name, ours, peer in zip(("transient", "stream"), taken, by_numpy, strict=True):
        sys.stdout.write(
            f"a tick, order {ORDER}: {name} {ours:.0f} ns (allowed {ALLOWED_NS:.0f}); NumPy {np.__version__} "
            f"{peer:.0f} ns, {peer / ours:.1f} times as long\n"
        )
    return int(taken.max() > ALLOWED_NS)


if __name__ == "__main__":
    sys.exit(main())
