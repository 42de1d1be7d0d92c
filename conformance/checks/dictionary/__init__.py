"""The object dictionary: what entries hold, take and refuse, and the rules between them."""
