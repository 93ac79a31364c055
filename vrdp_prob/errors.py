"""The one exception that a user's mistake becomes."""


class InputError(ValueError):
    """Input that cannot be used.

    The message is one sentence that says what is wrong, where (file, row, field) and how to mend it. The command
    line prints it and exits with code 2.
    """
