"""Lots of a delivery: how many units to draw, which, and whether the lot is accepted."""
