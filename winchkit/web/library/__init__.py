"""The Library view: ``runs`` of a folder with their verdicts, and the ``fleet`` as a grid."""
