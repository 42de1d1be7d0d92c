"""The node as it was found, given back after a run or after one that was cut short."""
