"""What a user can cause and mend, and how one ends a program from outside."""


class InputError(ValueError):
    """Bad input: says what was got, what is allowed and what to do about it.

    The command line prints the message without a traceback and exits with code 2.
    """


class Ended(KeyboardInterrupt):
    """A signal to end, SIGTERM or SIGHUP: it does what Ctrl-C does, so that what stands in `finally` is done.

    The command line raises it in place of these signals, and exits with 128 + number.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(f"ended by signal {number}")
