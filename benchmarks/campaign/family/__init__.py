"""Friction of many forms, recordings without information, wrong profiles, metamorphic relations."""
