"""Detection of a lost host by a drive: mechanisms, their set-up and their proof."""
