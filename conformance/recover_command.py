"""The command line's `recover`: gives a node back as a run that was cut short had found it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from conformance import resources
from conformance.bench.as_found import AsFound
from conformance.bench.definition import load_bench
from conformance.bench.journal import NAME, Journal, load_journal
from conformance.bench.seeking import bring_home
from conformance.bench.session import Bench
from conformance.errors import BenchError, ConformanceError, NodeTimeout, SpecError
from conformance.report.console import console
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec, address

TRACE = "recover.log"


def recover(
    journal: Annotated[
        Path, typer.Argument(metavar="JOURNAL", help=f"Folder of the run, or its {NAME}.")
    ],
    bench: Annotated[
        str | None, typer.Option(help="Another bench than that of the run: name or path.")
    ] = None,
) -> None:
    """Give a node back as it was before a run that was cut short; exit 0 if it is, 2 if not."""
    kept = load_journal(journal)
    folder = journal if journal.is_dir() else journal.parent
    if kept.given_back:
        console.say("nothing to recover: the run gave the node back itself")
        return
    spec = load_spec(Path(kept.device)).resolve(kept.variant, kept.node_id)
    path = (
        Path(kept.bench) if bench is None else resources.find("fixtures/benches", bench, "--bench")
    )
    update: dict[str, str | int] = {"bitrate": kept.bitrate, "node_id": kept.node_id}
    if bench is None and kept.channel is not None:
        update["channel"] = kept.channel
    definition = load_bench(path).model_copy(update=update)
    _require_known(spec, kept)
    opened = Bench.open(definition, spec, {}, folder / TRACE)
    try:
        left = _give_back(opened, kept)
    except BenchError:
        raise
    except ConformanceError as error:
        _say_by_hand(spec, kept)
        raise BenchError(f"{error}; what it had stored is to be set by hand") from error
    finally:
        opened.close()
    if left:
        console.table(("object", "octets it held", "octets it holds"), left)
        raise BenchError("the node does not take everything back: set it by hand, and store it")
    kept.keep(folder / NAME, kept.found, given_back=True)
    console.say(f"given back as it was found: {len(kept.found.held)} settings")


def _require_known(spec: DeviceSpec, kept: Journal) -> None:
    for key in (*kept.found.held, *(kept.found.stored or {}), *kept.found.offsets):
        if key not in spec.entries:
            raise SpecError(
                f"{kept.device}: expected the spec that the run was judged by, got one without "
                f"{address(*key)}"
            )


def _give_back(bench: Bench, kept: Journal) -> list[tuple[str, str, str]]:
    """Bring the node home and give back what it held; return what it does not take."""
    restarts = kept.found.stored is not None
    bring_home(bench, kept.found.held, restarts=restarts)
    found = AsFound(bench, kept.found, restarts=restarts)
    refused = ""
    try:
        found.put_back()
    except NodeTimeout:
        raise
    except ConformanceError as error:
        refused = str(error)
    left = [(it.object, it.before, it.after) for it in found.give_back()]
    if refused and not left:
        raise BenchError(refused)
    return left


def _say_by_hand(spec: DeviceSpec, kept: Journal) -> None:
    """Say what the node had stored, for who finds it by other means."""
    stored = kept.found.held if kept.found.stored is None else kept.found.stored
    rows = []
    for key, data in stored.items():
        entry = spec.entries.get(key)
        if isinstance(data, bytes) and entry is not None and entry.writable:
            rows.append((address(*key), entry.name, data.hex(" ").upper()))
    console.table(("object", "name", "octets, the lowest first"), rows)
