"""Defects put before the suite, one device each: which check sees it, and what else it accuses."""
