"""The command line's `recover`: gives a node back as a run that was cut short had found it."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated

import typer

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.given_back.as_found import AsFound
from conformance.bench.given_back.journal import NAME, Journal, load_journal
from conformance.bench.given_back.seeking import bring_home
from conformance.bench.session import Bench
from conformance.errors import (
    BenchError,
    ConformanceError,
    NodeTimeout,
    SetupRefused,
    SpecError,
)
from conformance.report.console import console
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec, address

TRACE = "recover.log"
TRIES = 3
"""One answer that does not come on a busy computer is no reason to leave a node as it is."""

Left = list[tuple[str, str, str]]
"""Objects that do not hold what they held: address, before, now."""


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
    logging.getLogger("canopen").setLevel(logging.CRITICAL)  # what matters comes as an exception
    opened = Bench.open(definition, spec, {}, folder / TRACE)
    try:
        left = _recovered(opened, kept)
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


def _recovered(bench: Bench, kept: Journal) -> Left:
    """Give back what the node held, from finding it on again where that ends half-way.

    Returns:
        What it does not take.

    Raises:
        NodeTimeout: It does not answer any more, or is found nowhere, in the last try as well.
        SetupRefused: It refuses a step in the last try as well.
    """
    for nth in range(2, TRIES + 1):
        try:
            return _give_back(bench, kept)
        except (NodeTimeout, SetupRefused) as error:
            console.say(f"{error}; beginning anew, try {nth} of {TRIES}")
    try:
        return _give_back(bench, kept)
    except SetupRefused:
        left = _left(AsFound(bench, kept.found, restarts=kept.found.stored is not None))
        if not left:
            raise
        return left


def _give_back(bench: Bench, kept: Journal) -> Left:
    """Bring the node home and give back what it held; return what it does not take."""
    restarts = kept.found.stored is not None
    bring_home(bench, kept.found.held, restarts=restarts)
    found = AsFound(bench, kept.found, restarts=restarts)
    found.put_back()
    return _left(found)


def _left(found: AsFound) -> Left:
    return [(it.object, it.before, it.after) for it in found.give_back()]


def _say_by_hand(spec: DeviceSpec, kept: Journal) -> None:
    """Say what the node had stored, for who finds it by other means."""
    stored = kept.found.held if kept.found.stored is None else kept.found.stored
    rows = []
    for key, data in stored.items():
        entry = spec.entries.get(key)
        if isinstance(data, bytes) and entry is not None and entry.writable:
            rows.append((address(*key), entry.name, data.hex(" ").upper()))
    console.table(("object", "name", "octets, the lowest first"), rows)
