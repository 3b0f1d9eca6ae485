"""What a tick of an exported controller costs: order 26, 200 ms of preview, compiled as docs/controller.md says."""

import re
import subprocess
import sys
import tempfile
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


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "out"
        export_controller(ControllerPlan(model_file(Path(name)), out))
        command = [
            *vendor_stub.compiler(),
            "-std=c11",
            "-O2",
            "-o",
            str(out / "check"),
            str(out / "check_controller.c"),
        ]
        subprocess.run([*command, "-lm"], check=True, timeout=240)
        said = [
            subprocess.run([str(out / "check")], capture_output=True, text=True, check=True).stdout for _ in range(RUNS)
        ]
    taken = np.array([[float(each) for each in re.findall(r"(\d+) ns", text)] for text in said]).min(axis=0)
    report = f"a tick, order {ORDER}: transient {taken[0]:.0f} ns, stream {taken[1]:.0f} ns (allowed {ALLOWED_NS:.0f})"
    sys.stdout.write(report + "\n")
    return int(taken.max() > ALLOWED_NS)


if __name__ == "__main__":
    sys.exit(main())
