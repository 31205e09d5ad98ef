"""The command line, a file a command: parse, call one function, render. The only room that prints."""

from lab.cli.app import main

__all__ = ["main"]
