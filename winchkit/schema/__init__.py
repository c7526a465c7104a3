"""What files declare, as frozen dataclasses in SI; :mod:`winchkit.schema.read` reads them."""
