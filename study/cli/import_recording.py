"""Command `hapteq import`: converts files of other programs to one hapteq recording in SI units.

Parses the options and calls `study.workflows.recording.import_recording`; prints a map to be completed where the
channels of the files are unknown. Loaded by `command_table`, under the name of this module because `import` is a
keyword.
"""

import json
from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.screen import print_file_text


def import_recording(
    files: Annotated[list[Path], typer.Argument(help="Tables, XLSX, JSON, NPZ, NPY, MAT or HDF5 files, or a folder.")],
    out: Annotated[Path, typer.Option(help="The recording to write, REC.h5.")],
    map_name: Annotated[
        str | None,
        typer.Option(
            "--map",
            help="What is what in them: MAP.toml, or the name of a map that comes with hapteq [default: found].",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write one recording: units in SI, all channels on one rate, clocks aligned. All changes are reported.

    Without a map, three kinds of files are read: tables and arrays whose names contain units (time [s], fx [N],
    pos_mm, ...), files that a shipped map fits, and hapteq recordings. For other files a map to be completed is
    printed.
    """
    from study.cli.look import print_lines
    from study.cli.progress import show_share
    from study.importing.map_format.map_errors import MapNeededError
    from study.workflows.recording.import_recording import ImportPlan
    from study.workflows.recording.import_recording import import_recording as convert_files

    try:
        with show_share("Importing") as on_progress:
            import_result = convert_files(ImportPlan(tuple(files), map_name, out), on_progress)
    except MapNeededError as error:
        print_file_text(error.skeleton)
        raise
    recording = import_result.recording
    if as_json:
        document = {
            "recording": str(out), "map": import_result.map, "sample_rate_hz": recording.sample_rate_hz,
            "samples": len(recording), "command": list(recording.command.channels),
            "response": list(recording.response.channels), "segments": len(recording.segments),
            "notes": list(import_result.notes),
        }  # fmt: skip
        typer.echo(json.dumps(document, indent=2))
    else:
        typer.echo(str(out))
    print_lines((f"Note: {note}" for note in import_result.notes), to_stderr=True)
