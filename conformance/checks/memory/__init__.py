"""The non-volatile memory: store and restore."""
