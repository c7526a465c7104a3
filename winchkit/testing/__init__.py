"""For users' own tests: a pytest plugin with simulated benches, faults on request and assertions.

The plugin is :mod:`winchkit.testing.plugin`; installing winchkit registers it with pytest.
"""
