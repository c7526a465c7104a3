"""``python -m winchkit``: the command line."""

from winchkit.cli import main

if __name__ == "__main__":
    main(prog_name="winchkit")
