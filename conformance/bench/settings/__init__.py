"""The node's settings: written, stored, tried, moved, and put back."""
