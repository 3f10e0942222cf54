"""Clips of foreign rigs brought onto the 24 joints."""
