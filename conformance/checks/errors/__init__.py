"""EMCY, its history, and what brings errors about (CiA 301 v4.2.0, 7.2.7)."""
