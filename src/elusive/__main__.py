"""`python -m elusive` is the command line."""

from elusive.cli import entry

entry()
