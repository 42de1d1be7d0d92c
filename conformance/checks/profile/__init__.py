"""What an inclinometer measures, and by which settings (CiA 410)."""
