"""The program `guideload`, also by `python -m guideload`: the command line, behind handlers of signals."""

from guideload.cli import signals


def main() -> None:
    """Run the command line. The modules that it imports take longer than a user needs to press Ctrl-C."""
    signals.end_at_once()
    try:
        from guideload.cli.main import main as command_line

        command_line(prog_name="guideload")
    finally:
        signals.ignore()


if __name__ == "__main__":
    main()
