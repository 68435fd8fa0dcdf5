"""`python -m guideload`: the command line."""

from guideload.cli.main import main

if __name__ == "__main__":
    main(prog_name="guideload")
