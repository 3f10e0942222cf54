"""The version of this package, read where files say who wrote them."""

VERSION = "0.1.0"
