"""What a contract says when it does not hold."""


def require(holds: bool, otherwise: str) -> None:
    """Raises an AssertionError that says what is wrong, also where Python leaves asserts out."""
    if not holds:
        raise AssertionError(otherwise)
