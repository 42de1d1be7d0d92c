"""One run: what is judged, on which bench, and its record while it grows."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from _pytest.mark.expression import Expression  # the language of -k, not exported

from conformance import resources
from conformance.bench.definition import BenchDefinition, load_bench
from conformance.bench.session import Bench
from conformance.checks import JUDGED_SERVICES
from conformance.effects import Effect
from conformance.errors import BenchError, SpecError
from conformance.report.junit import explain, write_junit
from conformance.report.results import Item, Results
from conformance.requirements import Case, Requirement
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict, VerdictWord
from conformance.wire.datatypes import DataType

SIMULATOR = "canopen_simulator"
SAVE_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What the user asked for; texts as given on the command line."""

    device: str
    variant: str | None = None
    bench: str = "simulator"
    node_id: int | None = None
    serial: str = ""
    simulate_spec: str | None = None
    faults: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()
    report_dir: Path | None = None
    seed: int = 0
    strict: bool = False
    select: str = ""

    @classmethod
    def from_pytest(cls, option: Any) -> RunOptions:
        """Return the options that pytest parsed."""
        return cls(
            device=option.device,
            variant=option.variant,
            bench=option.bench,
            node_id=option.node_id,
            serial=option.serial,
            simulate_spec=option.simulate_spec,
            faults=tuple(option.fault),
            readings=tuple(option.reading),
            report_dir=option.report_dir,
            seed=option.seed,
            strict=option.strict_level,
        )


class Run:
    """A run from its options to its record.

    Args:
        options: What the user asked for.
        progress: Called with each item's result.

    Raises:
        SpecError: The input is wrong; nothing was opened or sent.
    """

    def __init__(self, options: RunOptions, progress: Callable[[Item], None] | None = None) -> None:
        self.options = options
        self.progress = progress
        self.definition = load_bench(resources.find("fixtures/benches", options.bench, "--bench"))
        file = load_spec(resources.find("device_specs", options.device, "DEVICE"))
        node_id = self.definition.node_id if options.node_id is None else options.node_id
        self.spec: DeviceSpec = file.resolve(options.variant, node_id)
        self._factory = file.document.factory
        self.strict = options.strict
        self._selection = _selection(options.select)
        self._simulation = self._simulate()
        self.results = Results(self._provenance(), self._device(), strict=options.strict)
        self.directory: Path | None = None
        self.total = 0
        self._bench: Bench | None = None
        self._started = 0.0
        self._started_s = 0.0
        self._saved = 0.0
        self._line = 0
        self._item_started_s = 0.0

    # Before anything is opened

    def _simulate(self) -> dict[str, Any]:
        """Return the arguments for the simulated bus, none when the bench is another."""
        options = self.options
        simulated = self.definition.interface == SIMULATOR
        if not simulated:
            given = {
                "--simulate-spec": options.simulate_spec,
                "--fault": options.faults,
                "--reading": options.readings,
            }
            for name, value in given.items():
                if value:
                    raise SpecError(
                        f"{name}: expected the simulator as bench, got {options.bench!r}"
                    )
            return {}
        model = options.simulate_spec or options.device
        option = "--simulate-spec" if options.simulate_spec else "DEVICE"
        path = resources.find("device_specs", model, option)
        file = load_spec(path)
        variant = self.spec.variant if self.spec.variant in file.variants else None
        readings = _readings(options.readings)
        file.resolve(variant, self.spec.node_id, readings)
        for ambiguity in file.document.ambiguities:
            number = readings.get(ambiguity.id, 1)
            if number > 1 and not ambiguity.readings[number - 1].changes:
                raise SpecError(
                    f"--reading: expected one that changes a figure of the spec, got "
                    f"{ambiguity.id}={number}, which the simulated device cannot show"
                )
        for fault in options.faults:
            resources.find("fixtures/faults", fault, "--fault")
        return {
            "channel": str(path),
            "variant": variant,
            "node_id": self.spec.node_id,
            "readings": ",".join(options.readings),
            "faults": ",".join(options.faults),
            "seed": options.seed,
        }

    def refuses(self, effects: tuple[Effect, ...]) -> str:
        """Return why the bench cannot run a check with these effects, empty if it can."""
        bitrate = self.definition.bitrate or self.spec.bitrate
        as_made = (self.spec.node_id, bitrate) == (self._factory.node_id, self._factory.bitrate)
        if "restores" in effects and not as_made:
            return (
                "restoring the factory settings would move the node to another node-ID or bit rate"
            )
        return refusal(self.definition, effects)

    def selects(self, requirement: Requirement, case: Case) -> bool:
        """Tell whether the user's selection includes an item."""
        identifier = self.item_id(requirement, case)
        return self._selection is None or self._selection.evaluate(
            lambda part, /, **_: part in identifier
        )

    # While it runs

    def open(self, total: int) -> Bench:
        """Open the bench, find the node and begin the record.

        Raises:
            BenchError: There is no bus, no node, or no place for the record.
        """
        self.total = total
        self.directory = self._make_directory()
        self._started = time.monotonic()
        self._bench = Bench.open(
            self.definition, self.spec, self._simulation, self.directory / "trace.log"
        )
        self._started_s = self._item_started_s = self._bench.link.now()
        self.results.run["started"] = datetime.now(UTC).isoformat(timespec="seconds")
        self._bench.find_node()
        self.results.device["identity"] = self._identity(self._bench)
        return self._bench

    @property
    def opened(self) -> bool:
        """The run got as far as opening its bench."""
        return self.directory is not None

    def _make_directory(self) -> Path:
        wanted = self.options.report_dir
        if wanted is None:
            stamp = datetime.now().strftime("%Y%m%d-%H%M%S")  # noqa: DTZ005 - for people, local
            parts = [stamp, self.spec.name, self.spec.variant, _file_name(self.options.serial)]
            wanted = Path("reports", "runs", "-".join(part for part in parts if part))
        try:
            wanted.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BenchError(f"cannot make {wanted}: {error.strerror}") from error
        return wanted

    def _identity(self, bench: Bench) -> dict[str, Any]:
        """Read what the node says it is; texts from it are data, never trusted."""
        node = bench.node()
        identity: dict[str, Any] = {}
        for entry in self.spec.by_kind("identity"):
            if not entry.readable or entry.optional:
                continue
            transfer = node.sdo.upload(entry.index, entry.sub)
            if transfer.data is None:
                identity[entry.address] = str(transfer)
                if transfer.fault:
                    break
            elif entry.type is DataType.VISIBLE_STRING:
                identity[entry.address] = transfer.data.decode("latin-1")
            else:
                identity[entry.address] = transfer.data.hex(" ").upper()
        return identity

    def item_id(self, requirement: Requirement, case: Case) -> str:
        """Return the stable id of one item."""
        parts = (self.spec.name, requirement.id, case.label)
        return "/".join(part for part in parts if part)

    def begin_item(self) -> None:
        """Note where an item begins on the bus."""
        if self._bench is not None:
            self._line, self._item_started_s = self._bench.link.line, self._bench.link.now()

    def item(
        self,
        requirement: Requirement,
        case: Case,
        word: VerdictWord,
        verdict: Verdict,
        reason: str = "",
    ) -> Item:
        """Return the result of one item; what happened on the bus since it began is its trace."""
        first, last = self._line + 1, self._bench.link.line if self._bench else 0
        now = self._bench.link.now() if self._bench else 0.0
        failed = [m for m in verdict.measurements if not m.ok]
        decisive = (failed or verdict.measurements)[:1] if failed else verdict.measurements[-1:]
        shown = decisive[0] if decisive and word in ("pass", "fail") else None
        manual = self.spec.cite(case.section) if case.section else ""
        return Item(
            id=self.item_id(requirement, case),
            requirement=requirement.id,
            sentence=requirement.sentence,
            level=requirement.level,
            source="; ".join(part for part in (manual, requirement.source) if part),
            service=requirement.service,
            object=case.label,
            verdict=word,
            expected=shown.expected if shown else "",
            actual=shown.actual if shown else "",
            unit=shown.unit if shown else "",
            quantity=shown.quantity if shown else "",
            reason=reason,
            duration_s=round(now - self._item_started_s, 6),
            trace=f"trace.log:{first}-{last}" if last >= first else "",
            readings=dict(verdict.readings),
            deviations=tuple(
                {"quantity": m.quantity, "expected": m.expected, "actual": m.actual} for m in failed
            ),
        )

    def record(self, item: Item) -> None:
        """Add a result to the record, and save the record now and then."""
        self.results.items.append(item)
        if self.progress is not None:
            self.progress(item)
        now = time.monotonic()
        if now - self._saved >= SAVE_EVERY_S:
            self._saved = now
            self._save()

    def explain(self, item: Item) -> str:
        """Return a result as text for a terminal."""
        return explain(item) if item.verdict == "fail" else f"{item.id}: {item.reason}"

    def abort(self, reason: str) -> None:
        """Note that the run ends early."""
        self.results.aborted = self.results.aborted or reason

    def close(self) -> None:
        """Close the bench and write the record, whatever the run has come to."""
        bench, self._bench = self._bench, None
        self.results.complete = not self.results.aborted and len(self.results.items) >= self.total
        if bench is not None:
            self.results.run["simulated_s" if bench.link.rig else "bus_s"] = round(
                bench.link.now() - self._started_s, 3
            )
            self.results.run["frames"] = bench.link.line
            self.results.run["unsolicited_sdo_responses"] = bench.channel.unsolicited
            try:
                bench.close()
            except BenchError as error:
                self.abort(str(error))
        self.results.run["finished"] = datetime.now(UTC).isoformat(timespec="seconds")
        self.results.run["wall_s"] = round(time.monotonic() - self._started, 3)
        try:
            self._save()
            if self.directory is not None:
                write_junit(self.results, self.directory / "junit.xml")
        except BenchError as error:
            self.abort(str(error))

    def _save(self) -> None:
        if self.directory is not None:
            self.results.write(self.directory / "results.json")

    # Provenance

    def _provenance(self) -> dict[str, Any]:
        options = self.options
        return {
            "suite": version("canopen-conformance"),
            "spec": self.spec.name,
            "spec_sha256": self.spec.sha256,
            "bench": options.bench,
            "interface": self.definition.interface,
            "bitrate": self.definition.bitrate or self.spec.bitrate,
            "seed": options.seed,
            "simulate_spec": options.simulate_spec or "",
            "faults": list(options.faults),
            "simulated_readings": list(options.readings),
            "strict": options.strict,
            "not_judged": sorted(set(self._documented_services()) - JUDGED_SERVICES),
            "python": platform.python_version(),
            "python_can": version("python-can"),
            "canopen": version("canopen"),
            "system": platform.system(),
        }

    def _documented_services(self) -> list[str]:
        services = self.spec.services
        return [name for name in type(services).model_fields if getattr(services, name) is not None]

    def _device(self) -> dict[str, Any]:
        spec = self.spec
        return {
            "spec": spec.name,
            "vendor": spec.device.vendor,
            "name": spec.device.name,
            "variant": spec.variant,
            "node_id": spec.node_id,
            "serial": self.options.serial,
            "manual": spec.cite("").rstrip(", "),
        }


def refusal(definition: BenchDefinition, effects: tuple[Effect, ...]) -> str:
    """Return why a bench cannot run a check with these effects, empty if it can."""
    missing = [effect for effect in effects if effect not in definition.allow]
    if missing:
        return f"the bench does not allow {' and '.join(missing)}"
    if "power" in effects and definition.power == "none":
        return "the bench cannot switch the supply"
    return ""


def _selection(text: str) -> Expression | None:
    """Return what `--select` says, in the language of pytest's `-k`; empty selects all."""
    try:
        return Expression.compile(text) if text else None
    except SyntaxError as error:
        raise SpecError(
            f"--select: expected parts of ids with and, or, not; got {text!r}"
        ) from error


def _readings(texts: tuple[str, ...]) -> dict[str, int]:
    readings = {}
    for text in texts:
        name, equals, number = text.partition("=")
        if not equals or not number.isdigit():
            raise SpecError(f"--reading: expected ID=N, got {text!r}")
        readings[name] = int(number)
    return readings


def _file_name(text: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in text)
