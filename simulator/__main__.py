"""`python -m simulator` is `photosite`."""

from simulator.command_line.main import main

if __name__ == "__main__":
    main()
