"""The version, in the one place that both the package and its reports read."""

VERSION = "0.1.0"
