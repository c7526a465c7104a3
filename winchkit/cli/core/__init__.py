"""Common parts of all commands: options, output, exit codes, dry run.

``lazy`` imports a command when it is called, ``outcome`` maps errors to exit codes, ``output``
writes text and JSON.
"""
