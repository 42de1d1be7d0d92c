"""Holds a CANopen device, real or simulated, against its own manual."""
