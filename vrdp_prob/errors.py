"""The one exception that a user's mistake becomes."""

from numbers import Integral


class InputError(ValueError):
    """Input that cannot be used.

    The message is one sentence that says what is wrong, where (file, row, field) and how to mend it. The command
    line prints it and exits with code 2.
    """


def check_whole_number(name: str, value: object, *, least: int) -> None:
    """Refuse what is no whole number, or too small a one.

    Parameters
    ----------
    name
        What it was given as.
    value
        What was given.
    least
        The smallest that can be used.

    Raises
    ------
    InputError
        In these cases.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
        raise InputError(f"{name} is {value!r}; give a whole number of at least {least}.")
