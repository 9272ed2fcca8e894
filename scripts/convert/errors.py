"""How a conversion stops."""


class ConversionError(Exception):
    """The source is not what the converter was written for; the message says what was found and what is needed."""
