"""`python -m orient_eye`: the command line."""

from orient_eye.cli import main

main()
