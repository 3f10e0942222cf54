"""hemline: real-time garments for virtual humans."""

__version__ = "0.1.0"
