"""The node under test: its SDO server, its NMT state, where it is reached."""
