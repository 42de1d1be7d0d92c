"""The bus: frames out and in, their times, what the adapter tells, and the trace."""
