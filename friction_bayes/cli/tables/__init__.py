"""Results as tables to read, one module a command."""
