"""Where a device and its model stand side by side: opens both, anew for each sequence."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from conformance import resources
from conformance.bench.definition import BenchDefinition, load_bench
from conformance.bench.session import Bench
from conformance.errors import BenchError, NodeTimeout, SetupRefused
from conformance.explore.pair import Difference, Pair
from conformance.explore.side import Side
from conformance.explore.steps import Step
from conformance.options import RunOptions, simulation
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec


class Laboratory:
    """The bench of the device under test and, beside it, a simulated one for the model.

    Args:
        options: What the user asked for, as of a run.

    Raises:
        SpecError: The input is wrong; nothing was opened or sent.
    """

    def __init__(self, options: RunOptions) -> None:
        self.definition: BenchDefinition = load_bench(
            resources.find("fixtures/benches", options.bench, "--bench")
        )
        self._path = resources.find("device_specs", options.device, "DEVICE")
        self.file = load_spec(self._path)
        node_id = self.definition.node_id if options.node_id is None else options.node_id
        self.spec = self.file.resolve(options.variant, node_id)
        factory = self.file.document.factory
        bitrate = self.definition.bitrate or self.spec.bitrate
        self.as_made = (self.spec.node_id, bitrate) == (factory.node_id, factory.bitrate)
        self._simulation = simulation(options, self.definition, self.spec)
        self._beside = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
        self._seed = options.seed
        self._device: Side | None = None
        self._specs: dict[frozenset[tuple[str, int]], DeviceSpec] = {}

    @property
    def _renews(self) -> bool:
        """Every sequence has a device as it left the factory."""
        return self.definition.simulated and self.definition.switches_supply

    @contextmanager
    def pair(self, readings: Mapping[str, int], trace: Path | None = None) -> Iterator[Pair]:
        """Have the device and a model that follows some readings, both just started.

        Args:
            readings: Ambiguity id to reading number, where not as judged.
            trace: File for what is on the device's bus.

        Raises:
            BenchError: There is no device, or it cannot be given back as it was.
        """
        device = self._open_device(trace)
        try:
            model = self._open_model(readings)
            try:
                self._start(device, model)
                yield Pair(device, model, self._under(readings))
            finally:
                model.close()
        finally:
            self._leave(device)

    def replay(
        self, steps: Sequence[Step], readings: Mapping[str, int], trace: Path | None = None
    ) -> Difference | None:
        """Take the device through some steps and return what differs from a model, if anything."""
        with self.pair(readings, trace) as pair:
            for step in steps:
                found = pair.take(step)
                if found is not None or pair.parted:
                    return found
            return pair.end()

    def close(self) -> None:
        """Close the device's bench."""
        if self._device is not None:
            self._device.close()
            self._device = None

    def _under(self, readings: Mapping[str, int]) -> DeviceSpec:
        known = frozenset(readings.items())
        if known not in self._specs:
            spec = self.file.resolve(self.spec.variant, self.spec.node_id, readings)
            self._specs[known] = spec
        return self._specs[known]

    def _open_device(self, trace: Path | None) -> Side:
        if self._renews or trace is not None:
            self.close()
        if self._device is None:
            bench = Bench.open(self.definition, self.spec, self._simulation, trace)
            self._device = Side(bench, self.spec)
        return self._device

    def _open_model(self, readings: Mapping[str, int]) -> Side:
        # spelt in another way, so that the model does not share a simulated device's bus
        channel = os.path.join(self._path.parent, os.curdir, self._path.name)  # noqa: PTH118
        options: dict[str, Any] = {
            "channel": channel,
            "variant": self.spec.variant,
            "node_id": self.spec.node_id,
            "readings": dict(readings),
            "seed": self._seed,
        }
        return Side(Bench.open(self._beside, self.spec, options, None), self.spec)

    def _start(self, device: Side, model: Side) -> None:
        model.find()
        if self._renews:
            device.find()
            return
        try:
            model.adopt(device.begin_with_settings())
        except (SetupRefused, NodeTimeout) as error:
            raise BenchError(f"the device cannot be taken from a known state: {error}") from error

    def _leave(self, device: Side) -> None:
        """Give the device back, or away."""
        try:
            device.give_back()
        except (SetupRefused, NodeTimeout) as error:
            raise BenchError(f"the device cannot be given back as it was: {error}") from error
        if self._renews:
            self.close()
