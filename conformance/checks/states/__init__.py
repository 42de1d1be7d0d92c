"""NMT slave, boot-up and heartbeat (CiA 301 v4.2.0, 7.2.8)."""
