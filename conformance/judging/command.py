"""The command line's `judge`: holds a recording of a device against its manual."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from conformance import resources
from conformance.commands.spec import NodeIdOption, ReportDirOption, VariantOption
from conformance.errors import BenchError, SpecError
from conformance.judging.record import Judging, write
from conformance.judging.recording import read_recording
from conformance.provenance import manual
from conformance.report.console import console
from conformance.report.folder import make_folder
from conformance.report.record import read_record
from conformance.report.report_page import write_page
from conformance.report.seal import write_seal
from conformance.report.summary import print_summary
from conformance.spec.load import load_spec

UNDECIDED = 2


def judge(
    recording: Annotated[
        Path, typer.Argument(metavar="TRACE", help="candump log, ASC or BLF (.log, .asc, .blf).")
    ],
    device: Annotated[str, typer.Option(help="Built-in name (see `devices`) or path of a spec.")],
    variant: VariantOption = None,
    node_id: NodeIdOption = None,
    bitrate: Annotated[
        int | None, typer.Option(min=1, help="Bit rate of the bus, in bit/s; the factory's.")
    ] = None,
    channel: Annotated[
        str | None, typer.Option(help="The recording's channel, where it has several.")
    ] = None,
    jitter_ms: Annotated[
        float, typer.Option(min=0, help="How far a timestamp of the recording may be off.")
    ] = 1.0,
    serial: Annotated[str, typer.Option(help="Serial number for the record.")] = "",
    report_dir: ReportDirOption = None,
) -> None:
    """Judge what a recording shows of a device; exit 0 conforms, 1 deviates, 2 undecided, 3 usage."""
    started = time.monotonic()
    file = load_spec(resources.find("device_specs", device, "--device"))
    spec = file.resolve(variant, node_id)
    if not jitter_ms < float("inf"):
        raise SpecError(f"--jitter-ms: expected a time, got {jitter_ms}")
    seen = read_recording(recording, channel)
    judging = Judging(seen, spec, bitrate or spec.bitrate, jitter_ms, serial)
    results = judging.results()
    results.manual = manual(file, spec.variant)
    results.run["wall_s"] = round(time.monotonic() - started, 3)
    folder = make_folder(report_dir, spec.name, "recording")
    write(results, seen, folder)
    write_page(read_record(folder))
    write_seal(folder)
    print_summary(results, str(folder), console)
    if results.exit_code == UNDECIDED:
        raise BenchError("what the recording shows does not decide it")
    raise typer.Exit(results.exit_code)
