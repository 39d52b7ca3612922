"""A program of its own that runs another one, and ends it with whoever started it, however that one ends.

    python guard.py PROGRAM ARGUMENT ...     # until PROGRAM ends, or standard input does

Who starts it holds the other end of its standard input, a pipe, which the system closes also where that process is
killed. (Linux' PR_SET_PDEATHSIG would not do: it goes by the thread that started the program, and nobody is left to
clean up.) The program's temporary files are in a folder that is removed when it has ended.
"""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time

END_S = 5.0
"""Until a program that was asked to end is killed."""


def main() -> None:
    """Run it; exits with its code, 128 + the signal's number where a signal ended it."""
    with tempfile.TemporaryDirectory(prefix="orient-eye-") as folder:
        program = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL, env={**os.environ, "TMPDIR": folder})
        signal.signal(signal.SIGTERM, lambda *_: program.terminate())
        threading.Thread(target=_end_with_input, args=[program], daemon=True).start()
        code = program.wait()
    sys.exit(code if code >= 0 else 128 - code)


def _end_with_input(program: "subprocess.Popen[bytes]") -> None:
    os.read(0, 1)  # nobody writes to it, so this returns at its end
    program.terminate()
    time.sleep(END_S)
    program.kill()


if __name__ == "__main__":
    main()
