"""The command line, a file a command: parse, call one function, render. The only room that prints."""


def main() -> None:
    """The `lab` command. Nothing is loaded before Ctrl-C is heard: the libraries of the commands take a while."""
    import sys

    from lab.cli.interrupt import ctrl_c_is_heard

    try:
        with ctrl_c_is_heard():
            from lab.cli.app import called

            code = called()
    except KeyboardInterrupt:  # before any command had begun
        from lab.cli.output import fail

        code = 130
        fail("stopped by Ctrl-C", code)
    sys.exit(code)
