"""Commands about files: check, export and shell completion."""
