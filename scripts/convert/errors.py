"""The error of a conversion."""


class ConversionError(Exception):
    """An unsupported source; the message has the actual and the required content."""
