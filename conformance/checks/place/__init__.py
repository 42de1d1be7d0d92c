"""How a node is reached: node-ID and bit rate."""
