"""The view of a robot on the page."""
