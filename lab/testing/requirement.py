"""The assertion that contract tests use."""


def require(holds: bool, otherwise: str) -> None:
    """Raises an AssertionError with the text `otherwise` unless `holds`, also if Python runs without assertions (-O)."""
    if not holds:
        raise AssertionError(otherwise)
