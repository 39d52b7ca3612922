"""The one exception a user can cause and mend."""


class InputError(ValueError):
    """Bad input: says what was got, what is allowed and what to do about it.

    The command line prints the message without a traceback and exits with code 2.
    """
