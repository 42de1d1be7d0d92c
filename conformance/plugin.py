"""The pytest plug-in: the options of a conformance run; the rest is loaded when one is asked for.

Without `--device` it does nothing and loads nothing; only its options are there.
"""

from __future__ import annotations

from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of a conformance run."""
    group = parser.getgroup("conformance", "CANopen conformance")
    group.addoption("--device", help="device spec: built-in name or path; switches the plug-in on")
    group.addoption("--variant", help="variant of the device; the first of its spec by default")
    group.addoption("--bench", default="simulator", help="bench: built-in name or path")
    group.addoption("--channel", help="another channel than that of the bench's file")
    group.addoption("--bitrate", type=int, help="another bit rate than the bench's, in bit/s")
    group.addoption("--node-id", type=int, help="node-ID of the device under test, 1..127")
    group.addoption("--serial", default="", help="serial number to put on the record")
    group.addoption("--eds", help="the device's EDS, to be heard at each deviation")
    group.addoption("--simulate-spec", help="build the simulated device from this spec instead")
    group.addoption(
        "--fault", action="append", default=[], help="defect of the simulated device (repeatable)"
    )
    group.addoption(
        "--reading", action="append", default=[], help="ID=N the simulated device follows"
    )
    group.addoption("--report-dir", type=Path, help="where the run's record goes")
    group.addoption("--seed", type=int, default=0, help="seed of everything random")
    group.addoption(
        "--strict-level", action="store_true", help="deviations at level should count as well"
    )
    group.addoption(
        "--scan", action="store_true", help="then look for objects that are not documented"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the conformance run when a device was named."""
    if config.option.device is not None:
        from conformance.session import attach  # noqa: PLC0415 - other people's runs never need it

        attach(config)
