"""Retargets clips of other rigs onto the 24 joints."""
