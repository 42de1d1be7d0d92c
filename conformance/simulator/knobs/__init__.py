"""The knobs of a simulated device that faults turn, one module per service."""
