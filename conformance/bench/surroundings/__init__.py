"""What is around the device: supply, tilt, and who changes them or looks at it."""
