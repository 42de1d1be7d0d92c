"""The small commands of the command line, and the options that all commands share."""
