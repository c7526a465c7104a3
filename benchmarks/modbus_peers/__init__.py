"""Peers for ``modbus_campaign.py`` that share no code with winchkit."""
