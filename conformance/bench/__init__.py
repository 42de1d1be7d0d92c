"""The only door to hardware: link, clock, SDO clients, and the node under test."""
