"""What the user asked of a run, checked before anything is opened or sent."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from _pytest.mark.expression import Expression  # the language of -k, not exported

from conformance import resources
from conformance.bench.definition import BenchDefinition
from conformance.effects import LACKING, Effect, Need
from conformance.errors import SpecError
from conformance.report.junit import Suites
from conformance.simulator.fault_files import load_faults
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec

_ITEM_ID = re.compile(r"\S+/[A-Z]+-\d+(/\S+)?")


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What the user asked for; texts as given on the command line."""

    device: str
    variant: str | None = None
    bench: str = "simulator"
    channel: str | None = None
    bitrate: int | None = None
    node_id: int | None = None
    serial: str = ""
    eds: str | None = None
    simulate_spec: str | None = None
    faults: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()
    report_dir: Path | None = None
    seed: int = 0
    strict: bool = False
    select: str = ""
    scan: bool = False
    dry_run: bool = False
    repro: str = ""
    acceptance: bool = False
    baseline: Path | None = None
    junit_suites: Suites = "device"

    def __post_init__(self) -> None:
        if not self.acceptance:
            return
        left_to_the_spec = {
            "--select": self.select,
            "--repro": self.repro,
            "--fault": self.faults,
            "--reading": self.readings,
            "--simulate-spec": self.simulate_spec,
            "--seed": self.seed,
            "--strict": self.strict,
            "--baseline": self.baseline,
        }
        given = [name for name, value in left_to_the_spec.items() if value]
        if given:
            raise SpecError(
                "--acceptance: expected everything to be judged as the spec has it, "
                f"got {' and '.join(given)} as well"
            )

    def arguments(self, variant: str) -> list[str]:
        """Return what to give the command `run` so that it does the same again.

        Args:
            variant: The one that was judged, also where the user named none.
        """
        single = {
            "--bench": "" if self.bench == "simulator" else self.bench,
            "--channel": self.channel or "",
            "--bitrate": "" if self.bitrate is None else str(self.bitrate),
            "--variant": variant,
            "--node-id": "" if self.node_id is None else str(self.node_id),
            "--simulate-spec": self.simulate_spec or "",
        }
        several = [("--fault", it) for it in self.faults] + [
            ("--reading", it) for it in self.readings
        ]
        pairs = [*((name, text) for name, text in single.items() if text), *several]
        texts = [text for pair in (*pairs, ("--seed", str(self.seed))) for text in pair]
        return [self.device, *texts, *(["--strict"] if self.strict else [])]

    @classmethod
    def from_pytest(cls, option: Any) -> RunOptions:
        """Return the options that pytest parsed."""
        return cls(
            device=option.device,
            variant=option.variant,
            bench=option.bench,
            channel=option.channel,
            bitrate=option.bitrate,
            node_id=option.node_id,
            serial=option.serial,
            eds=option.eds,
            simulate_spec=option.simulate_spec,
            faults=tuple(option.fault),
            readings=tuple(option.reading),
            report_dir=option.report_dir,
            seed=option.seed,
            strict=option.strict_level,
            scan=option.scan,
        )


def simulation(
    options: RunOptions, definition: BenchDefinition, spec: DeviceSpec
) -> dict[str, Any]:
    """Return the arguments for the simulated bus, none when the bench is another.

    Raises:
        SpecError: A fault, reading or spec of the simulated device is wrong, or there is none.
    """
    if not definition.simulated:
        given = {
            "--simulate-spec": options.simulate_spec,
            "--fault": options.faults,
            "--reading": options.readings,
        }
        for name, value in given.items():
            if value:
                raise SpecError(f"{name}: expected the simulator as bench, got {options.bench!r}")
        return {}
    model = options.simulate_spec or options.device
    option = "--simulate-spec" if options.simulate_spec else "DEVICE"
    path = resources.find("device_specs", model, option)
    file = load_spec(path)
    variant = spec.variant if spec.variant in file.variants else None
    readings = _readings(options.readings)
    file.changed(load_faults(options.faults).changes).resolve(variant, spec.node_id, readings)
    for ambiguity in file.document.ambiguities:
        number = readings.get(ambiguity.id, 1)
        if number > 1 and not ambiguity.readings[number - 1].changes:
            raise SpecError(
                f"--reading: expected one that changes a figure of the spec, got "
                f"{ambiguity.id}={number}, which the simulated device cannot show"
            )
    return {
        "channel": str(path),
        "variant": variant,
        "node_id": spec.node_id,
        "readings": readings,
        "faults": list(options.faults),
        "seed": options.seed,
    }


def refusal(
    definition: BenchDefinition, effects: tuple[Effect, ...], needs: tuple[Need, ...]
) -> str:
    """Return why a bench cannot run a check with these effects and needs, empty if it can."""
    missing = [effect for effect in effects if effect not in definition.allow]
    if missing:
        return f"the bench does not allow {' and '.join(missing)}"
    if "power" in effects and definition.power == "none":
        return "the bench cannot switch the supply"
    if "bitrate" in effects and not definition.sets_bitrate:
        return "the bit rate belongs to the interface and cannot be followed"
    lacking = [need for need in needs if not definition.has(need)]
    if "sudden-tilt" in lacking and not definition.has("tilt"):
        lacking = ["tilt", *(need for need in lacking if need not in ("tilt", "sudden-tilt"))]
    return " and ".join(LACKING[need] for need in lacking)


def selection(text: str) -> Callable[[str], bool]:
    """Return what `--select` says: the id of an item, or the language of pytest's `-k`; empty selects all."""
    if not text:
        return lambda _: True
    try:
        expression = Expression.compile(text)
        return lambda identifier: expression.evaluate(lambda part, /, **_: part in identifier)
    except SyntaxError as error:
        if _ITEM_ID.fullmatch(text):
            return lambda identifier: identifier == text
        raise SpecError(
            f"--select: expected parts of ids with and, or, not; got {text!r}"
        ) from error


def _readings(texts: tuple[str, ...]) -> dict[str, int]:
    readings = {}
    for text in texts:
        name, equals, number = text.partition("=")
        if not equals or not (number.isascii() and number.isdecimal()):
            raise SpecError(f"--reading: expected ID=N, got {text!r}")
        readings[name] = int(number)
    return readings
