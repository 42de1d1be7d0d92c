"""What only eyes can see: lights and label."""
