"""TPDOs and SYNC (CiA 301 v4.2.0, 7.2.2 and 7.2.5)."""
