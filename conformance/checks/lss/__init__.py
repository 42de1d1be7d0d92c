"""LSS slave (CiA 305 v3.0)."""
