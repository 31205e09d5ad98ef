"""The command line, one file for each command: parse, call one function, render. Only this room prints."""

GARBAGE = 10_000  # new objects between two garbage collections; with Python's 700 there are 180 while a command loads


def main() -> None:
    """Run the `lab` command. Nothing is loaded before Ctrl-C is handled, because the commands' libraries load slowly."""
    import atexit
    import gc
    import os
    import sys

    # the interpreter then ends without a last garbage collection, which takes 0.3 s of processor time
    atexit.register(gc.freeze)
    gc.set_threshold(GARBAGE)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if (
            getattr(sys, name) is None
        ):  # it is closed: otherwise the next file that is opened would get its descriptor and the output
            os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115
    try:
        from lab.cli.interrupt import ctrl_c_is_heard, ignore_ctrl_c

        atexit.register(ignore_ctrl_c)  # what was printed stands; it no longer makes a killed process of a finished one
        with ctrl_c_is_heard():
            from lab.cli.app import called

            code = called()
    except KeyboardInterrupt:  # before a command has begun
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
