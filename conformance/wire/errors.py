"""The one error of this package: bytes that do not follow the standard, or values that do not fit."""


class WireError(ValueError):
    """A frame or value contradicts CiA 301 or CiA 305; the message says what was expected and got."""
