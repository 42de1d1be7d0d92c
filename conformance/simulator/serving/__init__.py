"""Simulated devices as a process of their own, in real time."""
