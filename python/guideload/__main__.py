"""The program `guideload`, also by `python -m guideload`: the command line, behind handlers of signals."""

import gc

from guideload.cli import signals

# A command makes many objects that live as long as it does: with Python's 700, 4 % of the time of a command are spent
# in looking for cycles among them.
OBJECTS_BETWEEN_COLLECTIONS = 50_000


def main() -> None:
    """Run the command line. The modules that it imports take longer than a user needs to press Ctrl-C."""
    signals.end_at_once()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    try:
        from guideload.cli.main import main as command_line

        command_line(prog_name="guideload")
    finally:
        signals.ignore()


if __name__ == "__main__":
    main()
