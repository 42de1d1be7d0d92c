"""Gives sensors fresh from the box, which share one node-ID, each a node-ID of its own, and undoes it."""
