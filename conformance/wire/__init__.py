"""CANopen on the wire, sans-IO: bytes to frozen dataclasses and back (CiA 301 v4.2.0, CiA 305 v3.0)."""
