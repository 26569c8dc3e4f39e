"""The command line: options, commands, what they print and what they leave behind."""
