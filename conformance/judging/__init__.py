"""Judges recordings: what a device did on a bus, without a bench, from a file that somebody else made."""
