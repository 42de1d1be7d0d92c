"""The command line's `benches` and `doctor`: which benches there are, and what is wrong with one."""

from __future__ import annotations

import json
import logging
import sys
from collections import Counter
from dataclasses import asdict
from typing import Annotated, get_args

import typer

from conformance import resources
from conformance.bench.definition import BenchDefinition, load_bench
from conformance.bench.overriding import overridden
from conformance.checks.loading import load_checks
from conformance.commands.examination import Examination, Findings
from conformance.commands.spec import BenchOption, BitrateOption, ChannelOption
from conformance.effects import LACKING, Effect
from conformance.errors import BenchError, SpecError
from conformance.options import RunOptions, simulation
from conformance.report.console import console
from conformance.run import Run

USUAL_BITRATE = 125_000
"""In bit/s, where neither bench nor device says another."""


def benches() -> None:
    """List the built-in benches."""
    rows = []
    for name in resources.names("fixtures/benches"):
        bench = load_bench(resources.find("fixtures/benches", name, "--bench"))
        rows.append((name, bench.interface, bench.what))
    console.table(("bench", "interface", "what"), rows)


def doctor(
    bench: BenchOption = "simulator",
    channel: ChannelOption = None,
    bitrate: BitrateOption = None,
    device: Annotated[
        str, typer.Option(help="Tell what of this device the bench would skip.")
    ] = "",
    ask: Annotated[
        bool, typer.Option("--ask", help="Ask all node-IDs who they are, which sends frames.")
    ] = False,
    seconds: Annotated[float, typer.Option(min=0.1, max=600, help="How long to listen.")] = 3.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Say what is wrong with a bench, sending nothing unless --ask; exit 0 all well, 2 if not."""
    logging.getLogger("can").setLevel(logging.CRITICAL)
    path = resources.find("fixtures/benches", bench, "--bench")
    definition = overridden(load_bench(path), channel, bitrate)
    if definition.simulated and not device:
        raise SpecError("--device: expected the one to simulate, got none; or give --bench")
    rate, options, skipped = definition.bitrate or USUAL_BITRATE, {}, Counter[str]()
    if device:
        asked = RunOptions(device, bench=bench, channel=channel, bitrate=bitrate)
        run = Run(asked)
        rate = definition.bitrate or run.spec.bitrate
        options = simulation(asked, definition, run.spec)
        skipped = _skipped(run)
    found = Examination(definition, rate, options, seconds, ask).look()
    if as_json:
        facts = {**asdict(found), "allow": definition.allow, "skipped": skipped}
        sys.stdout.write(json.dumps({"bench": bench, **facts}, indent=1) + "\n")
    else:
        _say(definition, found, skipped)
    if found.problem:
        raise BenchError(found.problem)


def _skipped(run: Run) -> Counter[str]:
    """Return how many items of a device a bench skips, by the reason."""
    reasons: Counter[str] = Counter()
    for requirement in load_checks().values():
        for case in requirement.cases(run.spec):
            effects = (*requirement.effects, *case.effects)
            needs = tuple(dict.fromkeys((*requirement.needs, *case.needs)))
            reasons[run.refuses(effects, needs) or "runs"] += 1
    return reasons


def _say(definition: BenchDefinition, found: Findings, skipped: Counter[str]) -> None:
    channel = "" if definition.channel is None else f" {definition.channel}"
    rows = [("bus", f"{definition.interface}{channel} at {found.bitrate} bit/s")]
    if found.heard is not None:
        heard = found.heard
        rows.append(("heard", f"{heard.frames} frames, {heard.others} of them of no node"))
        rows += [(f"node {it}", _counted(what)) for it, what in sorted(heard.nodes.items())]
        rows.append(("errors", heard.errors or "none that the adapter told of"))
        rows += [(f"{rate} bit/s", f"{n} frames") for rate, n in found.elsewhere.items()]
        stamps = definition.stamps()
        rows.append(("times by", f"{stamps.stamper}, off by {stamps.jitter_ms:g} ms or more"))
    if found.late is not None:
        rows.append(("stamps late by", str(found.late)))
    if found.waits is not None:
        rows.append(("waits of 1 ms longer by", str(found.waits)))
    for node_id, objects in (found.asked or {}).items():
        text = ", ".join(f"{name} {held}" for name, held in objects.items())
        rows.append((f"node {node_id} answers", text))
        kinds = " or ".join(found.kinds[node_id])
        rows.append(("", f"as {kinds}" if kinds else "as no device that has a spec here"))
    rows.append(("may", ", ".join(definition.allow)))
    forbidden = [effect for effect in get_args(Effect) if effect not in definition.allow]
    rows.append(("may not", ", ".join(forbidden) or "nothing"))
    lacking = [text for need, text in LACKING.items() if not definition.has(need)]
    rows.append(("lacks", ", ".join(lacking) or "nothing"))
    rows += [(f"{count} items", reason) for reason, count in skipped.most_common()]
    console.table(("what", "found"), rows)


def _counted(what: Counter[str]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in sorted(what.items()))
