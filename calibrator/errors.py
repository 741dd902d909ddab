"""The one exception that users are meant to see."""


class CalibratorError(Exception):
    """Something the user can mend. The message is one line and ends with what to do."""
