"""What the node measures: a stimulus, and values, filters and slopes that follow it."""
