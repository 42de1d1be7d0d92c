"""Device spec: what a manual says a device does, as data with a source per figure."""
