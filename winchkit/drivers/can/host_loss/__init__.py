"""How a drive notices that its host has gone: mechanisms, their set-up and their proof."""
