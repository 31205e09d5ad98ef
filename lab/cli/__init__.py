"""The command line, a file a command: parse, call one function, render. The only room that prints."""

GARBAGE = 10_000  # objects before cycles are looked for; with Python's 700 they are 180 times while a command loads


def main() -> None:
    """The `lab` command. Nothing is loaded before Ctrl-C is heard: the libraries of the commands take a while."""
    import atexit
    import gc
    import os
    import sys

    # the interpreter ends without a last look for cycles in all that was loaded, which takes 0.3 s of processor
    atexit.register(gc.freeze)
    gc.set_threshold(GARBAGE)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:  # it was closed: no file of ours may take its place and be printed into
            os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115
    try:
        from lab.cli.interrupt import ctrl_c_is_heard

        with ctrl_c_is_heard():
            from lab.cli.app import called

            code = called()
    except KeyboardInterrupt:  # before any command had begun
        from lab.cli.output import fail

        code = 130
        fail("stopped by Ctrl-C", code)
    except (MemoryError, ImportError) as error:
        from lab.cli.output import fail
        from lab.errors import out_of_memory

        why, code = out_of_memory(error), 1
        if why is None:
            raise
        fail(str(why), code)
    sys.exit(code)
