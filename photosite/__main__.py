"""`python -m photosite` is the command `photosite`."""

from data_gen.command_line import main

if __name__ == "__main__":
    main()
