"""The command line's `commission`: a node-ID of its own for each sensor fresh from the box, and back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.overriding import overridden
from conformance.commands.spec import BitrateOption, ChannelOption, VariantOption
from conformance.commissioning.by_objects import legal_node_ids
from conformance.commissioning.doing import Commissioning
from conformance.commissioning.record import NAME, Record, load_record
from conformance.errors import BenchError, SpecError
from conformance.numbers import node_ids as parsed
from conformance.options import RunOptions, simulation
from conformance.report.console import console
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec


def commission(
    device: Annotated[
        str, typer.Argument(help="Built-in name (see `devices`) or path of a spec.")
    ] = "",
    bench: Annotated[
        str | None,
        typer.Option(help="Built-in bench or path of a bench file; the simulator if absent."),
    ] = None,
    channel: ChannelOption = None,
    bitrate: BitrateOption = None,
    variant: VariantOption = None,
    node_ids: Annotated[
        str, typer.Option(help="Those to give, as 10-17; the lowest free ones if absent.")
    ] = "1-127",
    to_bitrate: Annotated[
        int | None, typer.Option(help="Bit rate to give, in bit/s; as it is if absent.")
    ] = None,
    serial: Annotated[
        list[int] | None,
        typer.Option(help="Serial number of a sensor that is on the bus (repeatable)."),
    ] = None,
    one_by_one: Annotated[
        bool, typer.Option("--one-by-one", help="The operator connects one after the other.")
    ] = False,
    record: Annotated[Path, typer.Option(help="File for what was found and given.")] = Path(NAME),
    undo: Annotated[
        Path | None, typer.Option(metavar="RECORD", help="Give back all that this record tells of.")
    ] = None,
) -> None:
    """Give each sensor fresh from the box a node-ID of its own; exit 0 if all have it, 2 if not."""
    if undo is not None:
        _undo(undo, bench, channel, one_by_one=one_by_one)
        return
    bench = bench or "simulator"
    spec_path = resources.find("device_specs", device, "DEVICE")
    bench_path = resources.find("fixtures/benches", bench, "--bench")
    definition = overridden(load_bench(bench_path), channel, bitrate)
    spec = load_spec(spec_path).resolve(variant, definition.node_id)
    rate = to_bitrate or definition.bitrate or spec.bitrate
    options = simulation(RunOptions(device, bench=bench), definition, spec)
    doing = Commissioning(definition, spec, record, options)
    doing.require_way(rate)
    ids = _legal(spec, node_ids)
    _require_free(record)
    made = Record(
        device=str(spec_path.resolve()),
        variant=spec.variant,
        bench=str(bench_path.resolve()),
        channel=channel,
    )
    try:
        wrong = doing.give(made, serial or [], ids, rate, one_by_one=one_by_one)
    finally:
        _show(made)
    if wrong or not made.units:
        raise BenchError("\n".join(wrong) or "no sensor was found")
    console.say(f"undo it with: canopen-conformance commission --undo {record}")


def _undo(path: Path, bench: str | None, channel: str | None, *, one_by_one: bool) -> None:
    kept = load_record(path)
    if not kept.in_force:
        console.say("nothing to undo: all sensors are where they were found")
        return
    found = kept.in_force[0].found
    spec = load_spec(Path(kept.device)).resolve(kept.variant, found.node_id)
    bench_path = (
        Path(kept.bench) if bench is None else resources.find("fixtures/benches", bench, "--bench")
    )
    definition = overridden(load_bench(bench_path), channel or kept.channel, found.bitrate)
    try:
        wrong = Commissioning(definition, spec, path).take_back(kept, one_by_one=one_by_one)
    finally:
        _show(kept)
    if wrong:
        raise BenchError("\n".join(wrong))


def _legal(spec: DeviceSpec, text: str) -> Sequence[int]:
    legal = legal_node_ids(spec)
    asked = parsed("--node-ids", text)
    return [it for it in asked if it in legal]


def _require_free(record: Path) -> None:
    """Make sure that a record can be made without losing another one."""
    if not record.parent.is_dir():
        raise SpecError(f"--record: expected a file in a folder that is there, got {str(record)!r}")
    if record.exists() and load_record(record).in_force:
        raise SpecError(
            f"--record: expected another file, for {record} tells of sensors that were not brought "
            f"back: undo it first, or give another"
        )


def _show(record: Record) -> None:
    if not record.units:
        return
    rows = [
        (str(unit), str(unit.found.place), str(unit.given.place), unit.state)
        for unit in record.units
    ]
    console.table(("sensor", "was", "given", "state"), rows)
