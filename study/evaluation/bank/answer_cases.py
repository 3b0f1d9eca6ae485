"""Worker process that diagnoses the cases of a bank: `python -m study.evaluation.bank.answer_cases FOLDER`, started by
`study.evaluation.bank.ask_engine`.

It gets only the folder of open cases. It reads a case name per line on standard input, writes answer.json into the
case's folder, and prints the name when that is done. So that the test is blind, the process cannot import the code that
made the cases, and an audit hook stops it from opening the files of that code or any other file of the bank, such as
the labels (`isolate_process`).
"""

import hashlib
import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import analysis.diagnosis
import equalizer
import study
from study.evaluation.bank.proof_folder import ANSWER_FILE, BANK_FILE, CLEAN_FOLDER, MODEL_FILE, SETTINGS_FILE
from study.evaluation.bank.proof_seals import hash_case_files
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text

CHALLENGE_PACKAGE = "study.evaluation.challenge"
"""Package that makes the cases: while cases are answered, it cannot be imported, and its files cannot be opened."""
FILE_EVENTS = ("open", "os.listdir", "os.scandir", "os.chdir", "os.rename", "os.link", "os.symlink", "shutil.copyfile")
"""Python's audit events when files or folders are opened, listed, entered, renamed, linked or copied; their first
argument is the path that is checked."""
PROCESS_EVENTS = ("subprocess.Popen", "os.exec", "os.posix_spawn", "os.spawn", "os.system", "os.fork", "os.forkpty")
"""Python's audit events when a program is started. HDF5 opens files in C without any audit event, but only gets paths
that this module has built."""


def main(arguments: list[str]) -> None:
    """Read case names from standard input until it ends; answer each and print its name. arguments: the folder of open
    cases."""
    open_folder = Path(arguments[0]).absolute()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C reaches all; the parent ends this process
    isolate_process(open_folder)
    engine_hash = compute_engine_digest()
    for line in sys.stdin:
        answer_case(open_folder / line.strip(), engine_hash)
        sys.stdout.write(line)
        sys.stdout.flush()


def isolate_process(open_folder: Path) -> None:
    """Block the import of the challenge, and install an audit hook: from now on this process cannot open the files of
    the challenge, open or list anything of the bank but `open_folder`, or start a program. The import then raises
    ImportError, the rest PermissionError. The bank is the parent folder of `open_folder`, and for follow-ups and
    controls also the bank in whose folder they lie."""
    sys.modules[CHALLENGE_PACKAGE] = cast(ModuleType, None)
    bank_folders, real_open_folder = _find_bank_folders(open_folder), os.path.realpath(open_folder)
    challenge_folder = os.path.realpath(Path(study.__path__[0]).joinpath(*CHALLENGE_PACKAGE.split(".")[1:]))

    def is_inside(path: str, folder: str) -> bool:
        """Whether a path is the folder or in it."""
        return path == folder or path.startswith(f"{folder}{os.sep}")

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        """Raise PermissionError for an event that would break the blindness of the test."""
        if event in PROCESS_EVENTS:
            raise PermissionError(f"a diagnosis must not start a program ({event})")
        if event not in FILE_EVENTS or not arguments or not isinstance(arguments[0], str | bytes | os.PathLike):
            return
        path = os.path.realpath(os.fsdecode(arguments[0]))
        is_in_bank = any(is_inside(path, bank_folder) for bank_folder in bank_folders)
        if (is_in_bank and not is_inside(path, real_open_folder)) or is_inside(path, challenge_folder):
            raise PermissionError(f"a diagnosis must not open {path}")

    sys.addaudithook(audit)


def _find_bank_folders(open_folder: Path) -> set[str]:
    """Find the real paths of the folders of the bank: the parent folder of `open_folder`, and every folder with the
    settings of a bank up to three levels above it (controls/SEED/open), as it is written and behind links: in a path
    as it is written, ".." makes a folder look like a parent that is none."""
    near_folders = (*open_folder.parents[:3], *Path(os.path.realpath(open_folder)).parents[:3])
    settings_folders = (path for path in near_folders if (path / BANK_FILE).exists())
    return {os.path.realpath(path) for path in (open_folder.parent, *settings_folders)}


def answer_case(case_folder: Path, engine_hash: str) -> None:
    """Diagnose the case in `case_folder` and write answer.json atomically. An exception of the diagnosis is
    written as a failed answer. engine_hash: from `compute_engine_digest`."""
    start_s, processor_start_s = time.perf_counter(), time.process_time()
    try:
        document = _diagnose_case(case_folder)
    except Exception:  # noqa: BLE001 - the bank goes on, and the score counts it
        document = {"failed": traceback.format_exc()}
    document |= {
        "name": case_folder.name,
        "seconds": time.perf_counter() - start_s,
        "cpu_seconds": time.process_time() - processor_start_s,
        **hash_case_files(case_folder),
        "engine": engine_hash,
        "knows_the_challenge": is_challenge_loaded(),
    }
    write_text(case_folder / ANSWER_FILE, json.dumps(document, indent=1) + "\n", overwrite=True)


def is_challenge_loaded() -> bool:
    """Whether the challenge package has been imported. A blocked import leaves None in sys.modules, which does not
    count."""
    return any(
        f"{name}.".startswith(f"{CHALLENGE_PACKAGE}.")
        for name, module in vars(sys)["modules"].items()
        if module is not None
    )


def compute_engine_digest() -> str:
    """Compute the hash of the source code on which an answer depends: first 16 hex digits of SHA-256 over the Python
    files of `analysis.diagnosis` and `equalizer`."""
    digest = hashlib.sha256()
    for package in (analysis.diagnosis, equalizer):
        package_folder = Path(package.__path__[0])
        for source_file in sorted(package_folder.rglob("*.py")):
            digest.update(str(source_file.relative_to(package_folder)).encode() + source_file.read_bytes())
    return digest.hexdigest()[:16]


def _make_time_budget(processor_s: float | None) -> Callable[[], bool]:
    """Make a predicate that is true while processor time is left; with processor_s None it is always true. Processor
    time (s), not wall-clock time, so that the load of the machine does not change an answer."""
    start_s = time.process_time()
    return lambda: processor_s is None or time.process_time() - start_s < processor_s


def _diagnose_case(case_folder: Path) -> dict[str, Any]:
    """Diagnose the recordings in `case_folder` with the settings of the case. Returns the answer as JSON values."""
    from analysis.diagnosis.diagnose import diagnose
    from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
    from analysis.diagnosis.document import diagnosis_to_json
    from study.store.formats.mechanical_model_file import read_mechanical_model
    from study.store.formats.recording_file import read_recording

    case_settings = load_json(read_text(case_folder / SETTINGS_FILE))
    recordings = [read_recording(path) for path in sorted(case_folder.glob("*.h5"))]
    clean_recordings = tuple(read_recording(path) for path in sorted(case_folder.glob(f"{CLEAN_FOLDER}/*.h5")))
    settings = DiagnosisSettings(
        without=tuple(case_settings["without"]),
        clean=clean_recordings,
        discovery=bool(case_settings.get("discovery")),
        time_left=_make_time_budget(case_settings.get("processor_s")),
    )
    findings = diagnose(
        recordings, read_mechanical_model(case_folder / MODEL_FILE), settings, map, lambda step, share: None
    )
    errors = {stage: dict(channels) for stage, channels in findings.channel_errors.items()}
    answer = {
        "diagnosis": diagnosis_to_json(findings.diagnosis),
        "channel_errors": errors,
        "remarks": list(findings.remarks),
    }
    if (proposal := findings.proposal) is not None:
        experiment_names = [experiment.words for experiment in proposal.chosen.experiments]
        answer["proposal"] = {"axis": proposal.axis, "level": proposal.level, "best": experiment_names}
    return answer


if __name__ == "__main__":
    main(sys.argv[1:])
