"""The command line, `rsrl ...`: thin commands over the packages above it."""

from rsrl.cli.app import main

__all__ = ["main"]
