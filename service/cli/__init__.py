"""The commands that the service adds to ``occluder``: serve, submit and keys.

They are found by the entry points of the group ``occluder.commands``, and import what they need
when they run: ``occluder --help`` does not pay for a server.
"""
