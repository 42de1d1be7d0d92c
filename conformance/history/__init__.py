"""The memory of a site: units by device and serial number, the lots they came in, and their runs."""
