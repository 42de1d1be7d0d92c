"""Two runs of one device side by side, and the deviations that are known."""
