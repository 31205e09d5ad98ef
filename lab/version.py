"""The version of the lab, which is written into journals, policies and reports."""

__version__ = "0.2.0"
