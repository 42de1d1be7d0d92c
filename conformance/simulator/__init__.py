"""A CANopen device built from a device spec: sans-IO core, simulated bus, python-can interface."""
